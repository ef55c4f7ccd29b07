// A picture of the live page: node picture.js CHROMIUM ADDRESS FILE. Its small plots show a minute: they get most of one.
"use strict";
const { chromium } = require("playwright-core");

const [program, address, file] = process.argv.slice(2);
const SECOND = 1000;

(async () => {
  const browser = await chromium.launch({
    executablePath: program,
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
  });
  const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();
  await page.goto(address);
  await page.waitForSelector(".sensor .angle", { timeout: 60 * SECOND });
  await page.waitForTimeout(45 * SECOND);
  await page.screenshot({ path: file, fullPage: true });
  await browser.close();
})().catch((error) => {
  console.log(String((error && error.stack) || error));
  process.exit(1);
});
