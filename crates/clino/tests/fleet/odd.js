// Looks at the live page with gateways that are out of the ordinary: node odd.js CHROMIUM ADDRESS
// One has no sensor, one has 48 with names of every kind. The names come from the program on standard input, as JSON.
"use strict";
const assert = require("assert");
const { look, watched } = require("./look");
const axe = require("fs").readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const [program, address] = process.argv.slice(2);
const names = JSON.parse(require("fs").readFileSync(0, "utf8"));
const PATIENCE = { timeout: 60 * 1000 };

look(program, 390, 844, async (page) => {
  const { errors, foreign } = watched(page, address);
  await page.goto(address);
  await page.waitForFunction((count) => document.querySelectorAll(".sensor .angle").length === count, names.length, PATIENCE);
  const shown = await page.locator(".sensor .sensor-head > span:first-child").allTextContents();
  assert.deepEqual(shown, names, "names are text");
  assert.equal(await page.locator(".sensor img, .sensor script, .sensor b").count(), 0, "no element out of a name");
  assert.equal(await page.locator("#gateways section").count(), 2, "the gateway without a sensor is there, too");
  const overflow = () => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert(await overflow() <= 0, "no sideways scrolling: " + await overflow());
  for (const number of [0, 1, 2, names.length - 1]) {
    await page.locator(".sensor").nth(number).click();
    await page.waitForSelector("#plot .main-svg", PATIENCE);
    assert((await page.locator("#detail-title").textContent()).startsWith(names[number]));
    assert(await overflow() <= 0, "no sideways scrolling with sensor " + number + ": " + await overflow());
    await page.keyboard.press("Escape");
  }
  await page.evaluate(axe);
  const result = await page.evaluate(() => window.axe.run());
  assert.deepEqual(result.violations.map((found) => found.id + ": " + found.nodes.map((node) => node.target.join(" ")).join(", ")), []);
  assert.deepEqual(foreign, [], "no request to another host");
  assert.deepEqual(errors, [], "no error in the console");
  console.log("all well");
});
