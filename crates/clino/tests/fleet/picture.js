// A picture of the live page: node picture.js CHROMIUM ADDRESS FILE. Its small plots show a minute: they get most of one.
"use strict";
const { look } = require("./look");

const [program, address, file] = process.argv.slice(2);
const SECOND = 1000;

look(program, 1280, 900, async (page) => {
  await page.goto(address);
  await page.waitForSelector(".sensor .angle", { timeout: 60 * SECOND });
  await page.waitForTimeout(45 * SECOND);
  await page.screenshot({ path: file, fullPage: true });
});
