/*
 * Tests the page in a browser: dropping files, calibration, saving, diagnosis, cancelling, refusals, the layout on a phone, and the
 * live view. Saved files are compared with those that the program writes.
 * node page.mjs [--shots DIR] PAGE.html BENCH WANTED GOLDEN
 *   BENCH is a data set. WANTED is a folder with results of the program: poly13.json, observer.json, header/stretch.h and
 *   diagnosis.json for the data set; linked.csv and linked.told for linked.txt, the data of a board; and the messages *.told for
 *   doubtful trials (doubted/*.csv) and a doubtful stream (doubted.txt).
 */
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { tmpdir } from "node:os";
import { pathToFileURL } from "node:url";
import { faults } from "./layout.mjs";
import { browser, check, ended, named, shots } from "./support.mjs";

const [file, bench, wanted, golden] = named;
const text = (path) => readFileSync(path, "utf8");

const url = pathToFileURL(resolve(file)).href;

/** Opens a new page. Any request to another address and any error message counts as wrong. */
const opened = async (name, { width = 1280, scheme = "light", begin } = {}) => {
  const context = await browser.newContext({ viewport: { width, height: 844 }, colorScheme: scheme, reducedMotion: "reduce", acceptDownloads: true });
  const page = await context.newPage();
  page.on("request", (request) => {
    if (request.url() !== url && !request.url().startsWith("blob:")) check(false, `${name}: a request, ${request.url()}`);
  });
  page.on("websocket", () => check(false, `${name}: a socket`));
  page.on("pageerror", (error) => check(false, `${name}: ${error.message}`));
  page.on("console", (message) => { if (message.type() === "error") check(false, `${name}: ${message.text()}`); });
  if (begin) await page.addInitScript(begin);
  await page.goto(url);
  await until(page, () => document.querySelector("#model option"), null, 60_000);
  return page;
};
/** Waits until a function returns true in the page. Playwright's own function would need a content policy that allows eval. */
const until = async (page, is, given, limit = 300_000) => {
  const end = performance.now() + limit;
  while (!(await page.evaluate(is, given))) {
    if (performance.now() > end) throw new Error(`it never came: ${is}`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
};
const idle = (page) => until(page, () => !document.body.dataset.busy);
const put = async (page, files) => {
  await page.setInputFiles("#choose", files);
  await idle(page);
};
/** Drops files or folders onto the page, as a user does. */
const drop = async (page, paths) => {
  const session = await page.context().newCDPSession(page);
  const data = { items: [], files: paths.map((path) => resolve(path)), dragOperationsMask: 1 };
  const box = await page.locator("#drop").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  for (const type of ["dragEnter", "dragOver", "drop"]) await session.send("Input.dispatchDragEvent", { type, x, y, data });
  await until(page, () => state.files.size > 0 || document.body.dataset.busy);
  await idle(page);
};
const press = async (page, id) => {
  await page.click(`#${id}`);
  await idle(page);
};
const saved = async (page, id) => {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(`#${id}`)]);
  await idle(page);
  return { name: download.suggestedFilename(), text: text(await download.path()) };
};
const said = (page) => page.evaluate(() => {
  const wrong = document.getElementById("wrong");
  return wrong.hidden ? "" : wrong.textContent;
});
const all = readdirSync(bench).map((name) => join(bench, name));

/** The files that the page saves equal those of the program byte for byte. */
const same = async () => {
  const page = await opened("same");
  check(await page.evaluate(() => getComputedStyle(document.getElementById("recordings")).display) === "none", "the page shows no results before a file is dropped");
  await drop(page, [bench]);
  check(await said(page) === "", `the data set is read: ${await said(page)}`);
  check(await page.locator("#list tr").count() === all.filter((name) => name.endsWith(".csv")).length, "every trial has its row");
  check(await page.inputValue("#reference") === "length_mm" && await page.inputValue("#signal") === "bridge_v", "columns are guessed");
  check(await page.locator("#look").evaluate((c) => new Set(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).size > 4), "the recording is drawn");
  for (const model of ["poly13", "observer"]) {
    await page.selectOption("#model", model);
    await press(page, "calibrate");
    check(await said(page) === "", `${model}: ${await said(page)}`);
    const record = await saved(page, "save-record");
    check(record.name === "calibration.json", "the record's name");
    check(record.text === text(join(wanted, `${model}.json`)), `${model}: the record is the program's`);
    check(await page.locator("#errors tr").count() === 3, `${model}: raw, linear and itself are judged`);
  }
  const header = await saved(page, "save-header");
  check(header.text === text(join(wanted, "header/stretch.h")), "the header is the program's");
  await press(page, "see-calibration");
  const frame = page.frameLocator("#page");
  check((await frame.locator("h1").first().innerText()).includes("length_mm on bridge_v"), "the report opens in place");
  const plotted = frame.locator("svg.live[data-from]").first();
  await plotted.focus();
  await page.keyboard.press("+");
  check(await plotted.evaluate((e) => Number(e.dataset.to) - Number(e.dataset.from)) > 0, "its figures answer");
  check((await saved(page, "save-report")).text.startsWith("<!DOCTYPE html>"), "the report is saved");
  check((await page.innerText("#report-name")).includes("length_mm on bridge_v, observer"), `its heading names it: ${await page.innerText("#report-name")}`);
  check(await page.evaluate(() => document.getElementById("report").contains(document.activeElement)), "it has the focus");
  await page.click("#close-report");
  check(await page.evaluate(() => document.activeElement.id) === "see-calibration", "closed, the focus goes back");
  await press(page, "see-calibration");
  await page.selectOption("#model", "linear");
  check(await page.isHidden("#report"), "a report of other choices is closed");
  await press(page, "diagnose");
  const sentence = await page.innerText("#sentence");
  const flowing = (words) => words.replace(/\s+/g, " ").trim();
  check(flowing(text(join(wanted, "diagnosis.txt"))).startsWith(flowing(sentence)), `the diagnosis is the program's: ${sentence}`);
  console.log(`a diagnosis of the rig: ${Number(await page.getAttribute("#sentence", "data-seconds")).toFixed(1)} s`);
  await press(page, "see-diagnosis");
  check((await frame.locator(".verdict").first().innerText()).length > 20, "its report opens in place");
  check((await saved(page, "save-rig")).text.includes("[[effect]]"), "the rig that agrees is saved");
  check(JSON.parse((await saved(page, "save-diagnosis")).text).schema === 2, "the diagnosis is saved");
  if (shots) await page.screenshot({ path: join(shots, "page-1280.png"), fullPage: true });
  await page.context().close();
};

/** The steps of a new user: the sample, the best model, a cancelled diagnosis, and a diagnosis of the gauge alone. */
const stranger = async () => {
  const page = await opened("stranger");
  await press(page, "sample");
  await until(page, () => document.querySelectorAll("#list tr").length === 17, null, 60_000);
  await idle(page);
  const begun = performance.now();
  await page.selectOption("#model", "auto");
  await press(page, "calibrate");
  check(await said(page) === "", `auto: ${await said(page)}`);
  check((await page.innerText("#fitted")).startsWith("Chosen: observer"), "auto chooses");
  // the sample equals the data set that the program simulates, bit for bit
  check((await saved(page, "save-record")).text === text(join(wanted, "observer.json")), "auto gives the same calibration as the program");
  const offered = await page.locator("#model option").count() - 1;
  const judged = await page.locator("#rows tr").count();
  check(judged >= offered, `every model is judged: ${judged} of ${offered}`);
  console.log(`${await page.innerText("#fitted")} ${((performance.now() - begun) / 1000).toFixed(1)} s`);
  await page.click("#diagnose");
  await until(page, () => /stage|screen|fit|pairs|sets|nuisance|floor|noise|effect/.test(document.getElementById("doing").textContent), null, 60_000);
  check(await page.isVisible("#cancel"), "there is a button to cancel");
  await page.click("#cancel");
  await idle(page);
  check(await page.isHidden("#diagnosed") && await said(page) === "", "a diagnosis is cancelled");
  check((await page.innerText("#cancelled")).startsWith("Cancelled: "), "and the page says so");
  check((await saved(page, "save-record")).text === text(join(wanted, "observer.json")), "the calibration is kept after a cancelled diagnosis");
  await page.selectOption("#subject", "gauge");
  await press(page, "diagnose");
  check((await page.innerText("#sentence")).length > 20, "the gauge alone is diagnosed after it");
  const own = `time_s,pos_mm,out_v\n${Array.from({ length: 400 }, (_, i) => `${i * 0.01},${160 + i % 40},${1.5 + (i % 40) / 100}`).join("\n")}\n`;
  await put(page, [{ name: "own.csv", mimeType: "text/csv", buffer: Buffer.from(own) }]);
  await until(page, () => document.querySelectorAll("#list tr").length === 1, null, 60_000);
  await idle(page);
  check(await page.inputValue("#reference") === "pos_mm", "an own recording with other columns replaces the sample");
  await page.context().close();
};

/** Files that cannot be read are refused with the messages of the program, and the others are kept. */
const refused = async () => {
  const page = await opened("refused");
  const file = (name, body) => ({ name, mimeType: "text/csv", buffer: Buffer.from(body) });
  const rows = Array.from({ length: 400 }, (_, i) => `${i * 0.01},${160 + i % 40},${1.5 + (i % 40) / 100}`);
  await put(page, [file("bad.csv", "time_s,length_mm,bridge_v\n0,160,1.5\n0.01,x,1.6\n")]);
  const bad = "bad.csv, row 3, column length_mm: \"x\" is not a number; correct it or remove that row (1 of 2 rows cannot be read";
  check((await said(page)).startsWith(bad), `a bad number: ${await said(page)}`);
  await put(page, [file("empty.csv", ""), file("good.csv", `time_s,pos_mm,out_v\n${rows.join("\n")}\n`)]);
  check((await said(page)).startsWith("empty.csv"), "an empty file is named");
  check(await page.locator("#list tr").count() === 1, "the valid file stays in the list");
  check(await page.inputValue("#reference") === "pos_mm" && await page.inputValue("#signal") === "out_v", "columns are recognised by their units");
  check(await page.inputValue("#model") === "auto", "the page proposes the automatic choice of a model");
  const models = await page.locator("#model option").allTextContents();
  check(models.length > 5 && models.every((text) => text.includes(": ")), `the list explains each model: ${models.join("; ")}`);
  await page.selectOption("#model", "linear");
  await put(page, [file("held.csv", `time_s,pos_mm,out_v\n${rows.map((row) => `${row}1`).join("\n")}\n`)]);
  await page.selectOption("#list tr:nth-child(2) select", "test");
  await press(page, "calibrate");
  check((await page.innerText("#fitted")).includes("not used for the fit"), `a recording is held out: ${await page.innerText("#fitted")}`);
  check((await page.innerText("#judged-on")).startsWith("Judged on held"), `and judged on: ${await page.innerText("#judged-on")}`);
  await page.selectOption("#model", "poly13");
  check(await page.locator("#calibrated.stale").count() === 1, "results of other choices are greyed");
  check(await page.isDisabled("#save-record") && await page.isDisabled("#see-calibration"), "and cannot be saved");
  for (const fault of await page.evaluate(faults)) check(false, `greyed: ${fault}`);
  await page.selectOption("#model", "linear");
  await press(page, "calibrate");
  check(await page.locator("#calibrated.stale").count() === 0, "until they are computed again");
  await put(page, [file("text.csv", `time_s,pos_mm,out_v\n${rows.slice(0, 9).join("\n")}\n9,n/a,1.5\n`)]);
  await press(page, "calibrate");
  const remarks = await page.innerText("#notes") + await page.innerText("#remarks");
  check(remarks.includes("text.csv: a row is left out: row 11, column pos_mm"), `a row that is left out is named: ${remarks}`);
  await press(page, "clear");
  check(await page.isHidden("#calibration"), "all is cleared");
  await put(page, [file("mv.csv", `time_s,pos_mm,out_mV\n${rows.join("\n")}\n`)]);
  await press(page, "calibrate");
  check(await page.inputValue("#adc") === "12,0,3300", "the converter's volts are in the signal's unit");
  await press(page, "clear");
  await put(page, [file("bare.csv", rows.join("\n"))]);
  check((await said(page)).includes("name the columns with “Column names”"), `a field of the page is named: ${await said(page)}`);
  check(await page.getAttribute("#reading", "open") !== null, "and shown");
  const dated = rows.map((row, i) => `02/03/2026 10:00:${String((i * 0.01).toFixed(2)).padStart(5, "0")},${row.split(",").slice(1)}`);
  await press(page, "clear");
  await put(page, [file("dates.csv", `time_s,pos_mm,out_v\n${dated.join("\n")}\n`)]);
  check((await said(page)).includes("“Time column” time_s:dmy"), `the order of dates is asked for: ${await said(page)}`);
  await page.selectOption("#time-unit", "dmy");
  await press(page, "again");
  check(await said(page) === "" && await page.locator("#list tr").count() === 1, `and given: ${await said(page)}`);
  await page.selectOption("#time-unit", "");
  await press(page, "clear");
  await put(page, [file("short.csv", `time_s,pos_mm,out_v\n${rows.slice(0, 40).join("\n")}\n`)]);
  await page.selectOption("#model", "auto");
  await press(page, "calibrate");
  check(!(await said(page)).includes("name at least one file"), `too short: ${await said(page)}`);
  await press(page, "clear");
  await put(page, [file("clock.csv", `t,pos_mm,out_v\n${rows.join("\n")}\n`)]);
  if (await page.getAttribute("#reading", "open") === null) await page.click("#reading summary");
  await page.fill("#time", "t");
  await page.selectOption("#time-unit", "ms");
  await press(page, "again");
  check((await page.locator("#list td").nth(2).innerText()) === "100000", `read otherwise: ${await page.locator("#list td").nth(2).innerText()}`);
  await put(page, [{ name: "problem.toml", mimeType: "text/plain", buffer: Buffer.from("a = 1") }]);
  check((await said(page)).includes("stretch diagnose problem.toml"), "a simulator of one's own is the program's");
  await page.context().close();
};

/** Returns the doubts that the program printed on standard error, without the summary and without line breaks. */
const toldBy = (name) => text(join(wanted, name)).replace(/^[\d,]+ samples: .*?(?=^stretch: |$(?![^]))/gms, "").replace(/^stretch: /gm, "\u0000").replace(/\s+/g, " ").replaceAll("stretch convert", "the program: stretch convert").split("\u0000").map((one) => one.trim()).filter(Boolean);

/** Doubts about an evaluation have the same words as in the program. */
const doubted = async () => {
  const members = readdirSync(join(wanted, "doubted")).filter((name) => name.endsWith(".csv"));
  check(members.length > 6, `members: ${members.join(", ")}`);
  for (const member of members) {
    const page = await opened(member);
    await put(page, [join(bench, "inflation_50.csv"), join(bench, "deflation_50.csv"), join(wanted, "doubted", member)]);
    await page.getByLabel(`use of ${member}`).selectOption("test");
    await page.selectOption("#model", "poly13");
    await press(page, "calibrate");
    const found = await page.locator("#doubts li").allTextContents();
    const told = toldBy(`doubted/${member.replace(".csv", ".told")}`);
    check(told.length > 0 === (member !== "none.csv"), `${member}: the program said ${told.join("; ")}`);
    check(found.join("\n") === told.join("\n"), `${member}: the page doubts ${found.join("; ")}, the program ${told.join("; ")}`);
    await page.context().close();
  }
};

/** A calibration file is evaluated and applied as in the program. A note says whether a rig file is used. */
const used = async () => {
  const page = await opened("used");
  await put(page, [join(wanted, "poly13.json"), join(bench, "arbitrary_1.csv")]);
  await press(page, "evaluate");
  check(await said(page) === "", `a calibration file: ${await said(page)}`);
  const flat = (words) => words.replace(/\s+/g, " ").trim();
  check(flat(text(join(wanted, "evaluated.txt"))).startsWith(flat(await page.innerText("#off"))), `its error is the program's: ${await page.innerText("#off")}`);
  check(await page.locator("#record-errors tr").count() === 2, "raw and itself are judged");
  const estimates = await saved(page, "save-estimates");
  check(estimates.name === "estimate.csv" && estimates.text === text(join(wanted, "estimate.csv")), "its estimates are the program's");
  check(await page.inputValue("#line-rate") === "100", "live lines have its rate");
  await put(page, [join(bench, "inflation_50.csv")]);
  await page.getByLabel("use of inflation_50.csv").selectOption("test");
  check(await page.locator("#evaluated.stale").count() === 1, "its errors are greyed");
  await press(page, "evaluate");
  check((await page.innerText("#record-judged-on")).startsWith("Judged on inflation_50.csv."), `a test is enough: ${await page.innerText("#record-judged-on")}`);
  await put(page, ["nominal.toml", "dataset.toml"].map((name) => join(bench, name)));
  await put(page, [{ name: "fixed.toml", mimeType: "text/plain", buffer: readFileSync(join(bench, "nominal.toml")) }]);
  const notes = await page.innerText("#notes");
  check(notes.includes("nominal.toml: a diagnosis of the whole rig begins") && notes.includes("fixed.toml: it is not used"), `rig files: ${notes}`);
  const names = await page.locator("button").allInnerTexts();
  check(new Set(names).size === names.length, `no two buttons have a name: ${names}`);
  await page.context().close();
};

/** Layout and contrast, at the widths of a phone and of a desktop. */
const looks = async () => {
  for (const [width, scheme] of [[390, "light"], [390, "dark"], [1280, "light"], [1280, "dark"]]) {
    const name = `page ${width} ${scheme}`;
    const page = await opened(name, { width, scheme });
    if (shots) await page.screenshot({ path: join(shots, `begin-${width}-${scheme}.png`) });
    await put(page, all);
    await page.selectOption("#model", "poly13");
    await press(page, "calibrate");
    for (const fault of await page.evaluate(faults)) check(false, `${name}: ${fault}`);
    await press(page, "see-calibration");
    await page.waitForTimeout(300);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    check(wide <= 0, `${name}: with a report ${wide} px too wide`);
    if (shots) await page.screenshot({ path: join(shots, `${name.replaceAll(" ", "-")}.png`), fullPage: true });
    const unnamed = await page.evaluate(() => [...document.querySelectorAll("input, select, button")]
      .filter((e) => e.getClientRects().length && !(e.labels?.length || e.textContent.trim() || e.ariaLabel)).map((e) => e.id));
    check(!unnamed.length, `${name}: without a label: ${unnamed}`);
    await page.keyboard.press("Tab");
    check(await page.evaluate(() => document.activeElement !== document.body), `${name}: the keyboard reaches it`);
    await page.context().close();
  }
};

/** Replaces the serial port by one that sends the data of a test. */
const port = () => {
  const sent = { push: null, close: null };
  window.testPort = sent;
  const readable = () => new ReadableStream({ start(c) { sent.push = (t) => c.enqueue(new TextEncoder().encode(t)); sent.close = () => c.close(); } });
  const one = { readable: null, async open() { this.readable = readable(); }, async close() {} };
  Object.defineProperty(navigator, "serial", { value: { requestPort: async () => one } });
};
const live = async () => {
  const page = await opened("live", { begin: port });
  const record = { name: "poly13.json", mimeType: "application/json", buffer: readFileSync(join(wanted, "poly13.json")) };
  await put(page, [record]);
  check((await page.innerText("#record-in-use")).includes("poly13.json"), "a dropped record is used");
  const connect = async (form) => {
    await page.selectOption("#form", form);
    await page.click("#connect");
    await until(page, () => window.testPort.push !== null);
  };
  const send = async (body) => {
    // in pieces that end anywhere, as from a real port
    for (let i = 0; i < body.length; i += 777) await page.evaluate((piece) => window.testPort.push(piece), body.slice(i, i + 777));
  };
  await connect("numbers");
  await send(Array.from({ length: 500 }, (_, i) => `${(1.5 + 0.2 * Math.sin(i / 30)).toFixed(4)}\r\n`).join("") + "noise\n");
  await until(page, () => document.getElementById("link").textContent.startsWith("501 lines, 1 without"));
  await until(page, () => / mm$/.test(document.getElementById("length").textContent));
  check(await page.locator("#live-doubts li").count() === 0, "nothing makes one doubt them");
  const numbers = await saved(page, "save-trial");
  check(numbers.text.split("\n").length === 502 && numbers.text.startsWith("time_s,bridge_v,length_mm,estimate_mm\n0,1.5,,\n"), "numbers are recorded");
  check(await page.locator("#trace").evaluate((c) => new Set(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).size > 4), "and drawn");
  const disconnect = async () => {
    await page.evaluate(() => { window.testPort.close(); window.testPort.push = null; });
    await until(page, () => document.getElementById("connect").textContent === "Connect");
  };
  await disconnect();
  await connect("numbers");
  const stream = text(join(wanted, "doubted.txt"));
  await send(stream);
  await until(page, (count) => document.getElementById("link").textContent.startsWith(`${count} lines`), stream.split("\n").length - 1);
  const doubts = (await page.locator("#live-doubts li").allTextContents()).join("\n");
  check(doubts === toldBy("doubted.told").join("\n"), `of a stream the page doubts ${doubts}, the program ${toldBy("doubted.told").join("\n")}`);
  await disconnect();
  await connect("frames");
  await send(text(join(wanted, "linked.txt")));
  // the program breaks its lines at the width of the terminal, so line breaks are removed
  const [counts, , missing] = text(join(wanted, "linked.told")).replace(/\n(?=\S)/g, " ").split(";");
  const told = `${counts};${missing}`;
  await until(page, (all) => document.getElementById("link").textContent.startsWith(all), told, 20_000)
    .catch(async () => check(false, `of the link: ${await page.innerText("#link")}, the program: ${told}`));
  check((await saved(page, "save-trial")).text === text(join(wanted, "linked.csv")), "frames are recorded as the program records them");
  await page.context().close();
};

/** The receptors give the same bits as on a computer and on boards. */
const bits = async () => {
  const page = await opened("bits");
  const found = await page.evaluate(() => crew.hand(CALIBRATOR).call("golden"));
  check(found === text(golden).split("\n").filter((line) => !line.startsWith("#")).join("\n"), `golden checksums:\n${found}`);
  await page.context().close();
};

/** Measures the time for a million rows. */
const fast = async () => {
  const page = await opened("fast");
  const log = join(mkdtempSync(join(tmpdir(), "page-")), "long.csv");
  const row = (_, i) => {
    const length = 165 + 14 * Math.sin(i / 130) + 2 * Math.sin(i / 41);
    return `${(i / 100).toFixed(2)},${length.toFixed(4)},${(1.24 + 0.028 * (182 - length) + 0.01 * Math.cos(i / 130)).toFixed(5)}`;
  };
  writeFileSync(log, `time_s,length_mm,bridge_v\n${Array.from({ length: 1e6 }, row).join("\n")}\n`);
  const begun = performance.now();
  await put(page, [log]);
  await page.selectOption("#model", "poly13");
  const read = performance.now();
  await page.click("#calibrate");
  await until(page, () => !document.getElementById("calibrated").hidden, null, 60_000);
  const fitted = performance.now();
  const count = await page.locator("#list td").nth(0).innerText();
  console.log(`${count} rows: read in ${((read - begun) / 1000).toFixed(2)} s, calibrated with poly13 in ${((fitted - read) / 1000).toFixed(2)} s`);
  await idle(page);
  rmSync(log);
  check(await said(page) === "", `a long log: ${await said(page)}`);
  await page.context().close();
};

const steps = { bits, same, stranger, refused, doubted, used, looks, live, fast };
const only = process.env.ONLY?.split(",");
for (const [name, step] of Object.entries(steps)) {
  if (only && !only.includes(name)) continue;
  const begun = performance.now();
  await step().catch((error) => check(false, `${name}: ${error.message}`));
  console.log(`${name}: ${((performance.now() - begun) / 1000).toFixed(0)} s`);
}
await ended();
