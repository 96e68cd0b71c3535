/*
 * Opens reports in a browser, at the widths of a phone and of a desktop, in light and dark mode, and uses their figures.
 * node report.mjs [--shots DIR] REPORT.html ...
 */
import { basename, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { faults } from "./layout.mjs";
import { browser, check, ended, named, shots } from "./support.mjs";

/** Sends a pinch gesture (two fingers that move apart) through the touch input of the browser. */
const pinched = async (page, plot, size, name) => {
  const device = await page.context().newCDPSession(page);
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  const [x, y, before] = [box.x + box.width / 2, box.y + box.height / 2, await size()];
  const send = (type, apart) => device.send("Input.dispatchTouchEvent", {
    type, touchPoints: apart ? [{ x: x - apart, y, id: 0 }, { x: x + apart, y, id: 1 }] : [],
  });
  await send("touchStart", 20);
  for (const apart of [30, 45, 60]) await send("touchMove", apart);
  await send("touchEnd", 0);
  await page.waitForTimeout(60);
  check(await size() < 0.8 * before, `${name}: two fingers zoom`);
  await plot.focus();
  await page.keyboard.press("0");
};

/** @param {import("playwright-core").Page} page Uses the figures and checks their reactions. */
const touched = async (page, name) => {
  await page.evaluate(() => document.querySelectorAll("details").forEach((details) => { details.open = true; }));
  const plot = page.locator("svg.live[data-from]").first();
  if (await plot.count()) {
    await plot.scrollIntoViewIfNeeded();
    const box = await plot.boundingBox();
    const span = async () => plot.evaluate((e) => [Number(e.dataset.from), Number(e.dataset.to)]);
    const size = async () => { const [a, b] = await span(); return b - a; };
    const labels = async () => (await plot.locator("text").allTextContents()).join(" ");
    const middle = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(...middle);
    check(await page.locator(".tip").isVisible(), `${name}: hover shows a value`);
    check(/: [\u2212\d]/.test(await page.locator(".tip").innerText()), `${name}: hover tells a number`);
    const [before, said] = [await size(), await labels()];
    await page.mouse.click(...middle);
    await page.mouse.wheel(0, -300);
    await page.waitForTimeout(60);
    check(await size() < 0.99 * before, `${name}: the wheel zooms`);
    check(await labels() !== said, `${name}: the axis follows`);
    const [left] = await span();
    await page.mouse.move(...middle);
    await page.mouse.down();
    await page.mouse.move(middle[0] - 60, middle[1], { steps: 4 });
    await page.mouse.up();
    check((await span())[0] > left, `${name}: a drag moves`);
    await plot.focus();
    await page.keyboard.press("0");
    check(Math.abs(await size() - before) < 1e-9, `${name}: 0 shows it as it was`);
    await page.keyboard.press("+");
    check(await size() < before, `${name}: plus zooms`);
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("0");
    const same = await plot.evaluate((e) => {
      const others = [...document.querySelectorAll("svg.live[data-from]")];
      return others.filter((o) => o.dataset.from === e.dataset.from && o.dataset.to === e.dataset.to).length;
    });
    check(same >= 1, `${name}: linked plots`);
    await pinched(page, plot, size, name);
    const button = page.locator("figure:has(svg.live[data-from]) .legend button").first();
    const lines = async () => plot.locator("g path.line").count();
    const all = await lines();
    await button.click();
    check(await lines() === all - 1, `${name}: a name switches its trace off`);
    await button.click();
    check(await lines() === all, `${name}: and on`);
  }
  const bar = page.locator(".hit[role=button]:visible").first();
  if (await bar.count()) {
    await bar.scrollIntoViewIfNeeded();
    await bar.hover();
    check(await page.locator(".tip").isVisible(), `${name}: a bar tells its value`);
    let marked = 0;
    for (const one of (await page.locator(".hit[role=button]:visible").all()).slice(0, 8)) {
      await one.focus();
      await page.keyboard.press("Enter");
      marked += await page.locator("svg.live[data-from] .picked").count();
      await page.keyboard.press("Enter");
    }
    check(marked > 0, `${name}: a bar marks its samples`);
    check(await page.locator("svg.live[data-from] .picked").count() === 0, `${name}: and lets them go`);
  }
  const sliders = page.locator(".turns input");
  if (await sliders.count()) {
    const told = page.locator(".turns .left");
    const times = async () => Number(await told.getAttribute("data-times"));
    const curves = () => page.locator("svg.live[data-from] g path.line").evaluateAll((all) => all.map((p) => p.getAttribute("d")).join());
    const [fitted, drawn] = [await times(), await curves()];
    const table = await page.evaluate(() => document.body.textContent || "");
    check(table.includes((await told.innerText()).match(/\(([\d.]{3})/)?.[1] || "none"), `${name}: what is left is what the tables say`);
    await sliders.first().scrollIntoViewIfNeeded();
    await sliders.first().focus();
    for (let k = 0; k < 80; k += 1) await page.keyboard.press("ArrowRight");
    check(Math.abs(await times() - fitted) > 1e-6, `${name}: a slider changes what is left`);
    check(await curves() !== drawn, `${name}: and the curve`);
    await page.locator(".turns button").click();
    check(Math.abs(await times() - fitted) < 1e-12 && await curves() === drawn, `${name}: and back`);
  }
  const surface = page.locator("svg.live[data-yaw]").first();
  if (await surface.count()) {
    await surface.focus();
    const yaw = await surface.getAttribute("data-yaw");
    await page.keyboard.press("ArrowLeft");
    check(await surface.getAttribute("data-yaw") !== yaw, `${name}: a surface turns`);
    check(await surface.locator(".stem").count() > 0, `${name}: with stems`);
    await page.keyboard.press("0");
  }
};

for (const report of named) {
  const url = pathToFileURL(resolve(report)).href;
  for (const [width, scheme] of [[390, "light"], [390, "dark"], [1280, "light"], [1280, "dark"]]) {
    const name = `${basename(report, ".html")} ${width} ${scheme}`;
    const context = await browser.newContext({ viewport: { width, height: 844 }, colorScheme: scheme, hasTouch: true, reducedMotion: "reduce" });
    const page = await context.newPage();
    page.on("request", (request) => check(request.url() === url, `${name}: asks for ${request.url()}`));
    page.on("pageerror", (error) => check(false, `${name}: ${error.message}`));
    page.on("console", (message) => check(message.type() !== "error", `${name}: ${message.text()}`));
    await page.goto(url);
    if (shots) await page.screenshot({ path: `${shots}/${name.replaceAll(" ", "-")}.png`, fullPage: true });
    check(await page.evaluate(() => document.documentElement.classList.contains("answers")), `${name}: the script runs`);
    // the first picture of each part is visible together with the headline, except on pages whose main content is a table
    const isOfTables = /paper|challenge/.test(report);
    const begins = await page.evaluate(() => [...document.querySelectorAll("header")].map((header) => {
      const after = [...document.querySelectorAll("figure svg")].filter((svg) => svg.getClientRects().length
        && header.compareDocumentPosition(svg) & Node.DOCUMENT_POSITION_FOLLOWING);
      return after.length ? after[0].getBoundingClientRect().top - header.getBoundingClientRect().top : Infinity;
    }));
    check(isOfTables || begins.every((down) => down < 844), `${name}: the first pictures begin ${begins.map(Math.round)} px below their headlines`);
    await touched(page, name);
    check(await page.evaluate(() => window.injected === undefined), `${name}: a name ran as a program`);
    for (const fault of await page.evaluate(faults)) check(false, `${name}: ${fault}`);
    const cut = await page.evaluate(() => [...document.querySelectorAll(".scroll")].filter((frame) => frame.scrollWidth > frame.clientWidth + 1)
      .map((frame) => `${frame.ariaLabel?.slice(0, 40)}: ${frame.scrollWidth} px in ${frame.clientWidth}`));
    check(width < 1000 || !cut.length, `${name}: columns are cut: ${cut.join("; ")}`);
    await context.close();
  }
  const still = await browser.newContext({ javaScriptEnabled: false, viewport: { width: 390, height: 844 } });
  const page = await still.newPage();
  await page.goto(url);
  check(await page.locator("figure svg:visible").count() > 0, `${basename(report)}: without script the drawings stand`);
  await still.close();
}
console.log(`${named.length} reports at two widths and in two lights`);
await ended();
