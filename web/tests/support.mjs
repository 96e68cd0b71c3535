/*
 * What the tests in a browser share: the browser, what they are asked for, and what they count as wrong.
 */
import { chromium } from "playwright-core";
import { mkdirSync } from "node:fs";

const FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
  "--disable-sync", "--no-first-run"];

const words = process.argv.slice(2);
const at = words.indexOf("--shots");

/** The folder for pictures, where there is one. */
export const shots = at < 0 ? null : words.splice(at, 2)[1];
if (shots) mkdirSync(shots, { recursive: true });

/** What is said beside options. */
export const named = words;

/** A browser without anything that asks the network. */
export const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", headless: true, args: FLAGS });

let wrong = 0;

/** Says and counts what is not as it should be. */
export const check = (good, what) => {
  if (good) return;
  wrong += 1;
  console.log(`WRONG ${what}`);
};

/** Closes the browser; the status says whether anything was wrong. */
export const ended = async () => {
  await browser.close();
  console.log(wrong ? `${wrong} wrong` : "nothing wrong");
  process.exit(wrong ? 1 : 0);
};
