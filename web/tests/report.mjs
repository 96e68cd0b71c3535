/*
 * Opens reports in a browser, at the width of a phone and of a desk, in light and dark, and touches them.
 * node report.mjs [--shots DIR] REPORT.html ...
 */
import { chromium } from "playwright-core";
import { mkdirSync } from "node:fs";
import { basename, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
  "--disable-sync", "--no-first-run"];
const words = process.argv.slice(2);
const at = words.indexOf("--shots");
const shots = at < 0 ? null : words.splice(at, 2)[1];
if (shots) mkdirSync(shots, { recursive: true });

let wrong = 0;
const check = (good, what) => {
  if (good) return;
  wrong += 1;
  console.log(`WRONG ${what}`);
};

/** What a layout must not do, told in words; runs in the page. */
const faults = () => {
  const said = [];
  const root = document.documentElement;
  if (root.scrollWidth > root.clientWidth) said.push(`the page is ${root.scrollWidth} px wide, the window ${root.clientWidth}`);
  const named = (element) => (element.textContent || "").trim().slice(0, 40);
  for (const details of document.querySelectorAll("details")) details.open = true;
  for (const cell of document.querySelectorAll("td, th, p, li, dd, h1, h2, button, figcaption")) {
    if (!cell.getClientRects().length) continue;
    if (cell.scrollWidth > cell.clientWidth + 1 && getComputedStyle(cell).display !== "inline") said.push(`clipped: ${named(cell)}`);
  }
  // what scrolls in its own frame shows that it does; figures must not need to
  for (const drawing of document.querySelectorAll("figure svg")) {
    if (!drawing.getClientRects().length) continue;
    const frame = drawing.getBoundingClientRect();
    const texts = [...drawing.querySelectorAll("text")].map((t) => ({ t, r: t.getBoundingClientRect() }));
    for (const { t, r } of texts) {
      if (r.left < frame.left - 2 || r.right > frame.right + 2) said.push(`beyond its figure: ${named(t)} (${drawing.getAttribute("aria-label")?.slice(0, 40)})`);
    }
    for (let i = 0; i < texts.length; i += 1) {
      for (let k = i + 1; k < texts.length; k += 1) {
        const [a, b] = [texts[i].r, texts[k].r];
        const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (across > 2 && down > 5) said.push(`overlap: ${named(texts[i].t)} | ${named(texts[k].t)} (${drawing.getAttribute("aria-label")?.slice(0, 40)})`);
      }
    }
  }
  const part = (c) => { const v = c / 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; };
  const light = (color) => {
    const [r, g, b] = color.match(/[\d.]+/g).map(Number);
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const color = getComputedStyle(e).backgroundColor;
      if (!/rgba\(.*, 0\)|transparent/.test(color)) return color;
    }
    return "rgb(255, 255, 255)";
  };
  for (const element of document.querySelectorAll("p, td, th, li, dd, dt, h1, h2, button, summary, figcaption, svg text")) {
    if (!element.getClientRects().length) continue;
    const style = getComputedStyle(element);
    const [a, b] = [light(element instanceof SVGElement ? style.fill : style.color), light(behind(element))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) said.push(`contrast ${contrast.toFixed(1)}: ${named(element)}`);
  }
  return [...new Set(said)];
};

/** @param {import("playwright-core").Page} page Touches the figures and looks at what they do. */
const touched = async (page, name) => {
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

const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", headless: true, args: FLAGS });
for (const report of words) {
  const url = pathToFileURL(resolve(report)).href;
  for (const [width, scheme] of [[390, "light"], [390, "dark"], [1280, "light"], [1280, "dark"]]) {
    const name = `${basename(report, ".html")} ${width} ${scheme}`;
    const context = await browser.newContext({ viewport: { width, height: 844 }, colorScheme: scheme, reducedMotion: "reduce" });
    const page = await context.newPage();
    page.on("request", (request) => check(request.url() === url, `${name}: asks for ${request.url()}`));
    page.on("pageerror", (error) => check(false, `${name}: ${error.message}`));
    page.on("console", (message) => check(message.type() !== "error", `${name}: ${message.text()}`));
    await page.goto(url);
    if (shots) await page.screenshot({ path: `${shots}/${name.replaceAll(" ", "-")}.png`, fullPage: true });
    check(await page.evaluate(() => document.documentElement.classList.contains("answers")), `${name}: the script runs`);
    await touched(page, name);
    for (const fault of await page.evaluate(faults)) check(false, `${name}: ${fault}`);
    await context.close();
  }
  const still = await browser.newContext({ javaScriptEnabled: false, viewport: { width: 390, height: 844 } });
  const page = await still.newPage();
  await page.goto(url);
  check(await page.locator("figure svg:visible").count() > 0, `${basename(report)}: without script the drawings stand`);
  await still.close();
}
await browser.close();
console.log(wrong === 0 ? `${words.length} reports at two widths and in two lights` : `${wrong} faults`);
process.exit(wrong === 0 ? 0 : 1);
