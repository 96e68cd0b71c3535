/*
 * Code that the browser tests share: the browser, the command line, and the count of faults.
 */
import { chromium } from "playwright-core";
import { mkdirSync } from "node:fs";

const FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
  "--disable-sync", "--no-first-run"];

const words = process.argv.slice(2);
const at = words.indexOf("--shots");

/** The folder for screenshots, if one is given. */
export const shots = at < 0 ? null : words.splice(at, 2)[1];
if (shots) mkdirSync(shots, { recursive: true });

/** The arguments without options. */
export const named = words;

/** A browser whose background services that use the network are off. */
export const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", headless: true, args: FLAGS });

let wrong = 0;

/** Prints and counts a fault unless a condition holds. */
export const check = (good, what) => {
  if (good) return;
  wrong += 1;
  console.log(`WRONG ${what}`);
};

/** Closes the browser. The exit status is 1 if there was a fault. */
export const ended = async () => {
  await browser.close();
  console.log(wrong ? `${wrong} wrong` : "nothing wrong");
  process.exit(wrong ? 1 : 0);
};
