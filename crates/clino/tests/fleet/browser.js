// Looks at the live page with a browser: node browser.js CHROMIUM ADDRESS FOLDER
"use strict";
const assert = require("assert");
const { look, watched } = require("./look");
const axe = require("fs").readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const [program, address, folder] = process.argv.slice(2);
const SECOND = 1000;

look(program, 1280, 900, async (page) => {
  const { errors, foreign } = watched(page, address);
  await page.goto(address);
  await page.waitForSelector(".sensor .angle", { timeout: 60 * SECOND });
  await page.waitForFunction(() => document.querySelectorAll(".sensor .angle").length >= 5, null, { timeout: 60 * SECOND });
  console.log("sensors: " + await page.locator(".sensor").count());

  // Sensor 0 swings: its text changes within a second. The machine may be busy: the quickest of ten counts.
  const changes = await page.evaluate(async () => {
    const text = () => document.querySelector(".sensor .angle").textContent;
    const times = [];
    for (let round = 0; round < 10; round += 1) {
      const began = performance.now();
      const before = text();
      while (text() === before && performance.now() - began < 20000) await new Promise((done) => setTimeout(done, 5));
      times.push(Math.round(performance.now() - began));
    }
    return times;
  });
  console.log("changes after ms: " + changes.join(" "));
  assert(Math.min(...changes) < SECOND, "a change within a second");

  // By keyboard: a sensor, its plot, and back.
  await page.locator(".sensor").first().focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector("#plot .main-svg", { timeout: 60 * SECOND });
  assert.equal(await page.evaluate(() => document.activeElement.id), "close");
  await page.selectOption("#span", "3600");
  await page.waitForFunction(() => document.getElementById("plot").getAttribute("aria-label").includes("1 h"), null, { timeout: 30 * SECOND });
  await page.click("#pause");
  assert.equal(await page.getAttribute("#pause", "aria-pressed"), "true");
  await page.click("#pause");
  assert((await page.getAttribute("#needle", "transform")).startsWith("rotate("), "the line turns");
  const csv = await page.evaluate(async () => (await fetch(document.getElementById("csv").href)).text());
  assert(csv.startsWith("utc,lowest_deg,highest_deg"), csv.slice(0, 80));

  const check = async (what) => {
    await page.evaluate(axe);
    const result = await page.evaluate(() => window.axe.run());
    assert.deepEqual(result.violations.map((found) => found.id + ": " + found.nodes.map((node) => node.target.join(" ")).join(", ")), [], what);
  };
  // axe is given to the page by the driver, past its own policy, which forbids that to others.
  await check("light");
  await page.screenshot({ path: folder + "/page-light.png" });
  await page.emulateMedia({ colorScheme: "dark" });
  await check("dark");
  await page.screenshot({ path: folder + "/page-dark.png" });
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 390, height: 844 });
  // The plot follows the width of the window when it has changed.
  await page.waitForTimeout(500);
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert(overflow <= 0, "no sideways scrolling on a phone: " + overflow);
  await page.screenshot({ path: folder + "/page-phone.png" });
  await page.setViewportSize({ width: 1280, height: 900 });
  await page.keyboard.press("Escape");
  assert.equal(await page.isVisible("#detail"), false);

  // An irreversible-looking button asks first; "no" does nothing.
  await page.getByRole("button", { name: "Scan T7 bus" }).click();
  await page.getByRole("button", { name: "No", exact: true }).click();
  assert.equal(await page.locator("#note").textContent(), "");

  // The source goes: every value with it, and the page says so.
  console.log("unplug");
  await page.waitForFunction(() => document.querySelectorAll(".sensor .angle").length === 0, null, { timeout: 60 * SECOND });
  const texts = await page.locator(".sensor .none").allTextContents();
  assert(texts.length >= 5 && texts.every((text) => text === "no value: source gone"), texts.join("; "));
  assert((await page.locator(".gone").first().textContent()).startsWith("gone: "), "the page says why");

  assert.deepEqual(foreign, [], "no request to another host");
  assert.deepEqual(errors, [], "no error in the console");
  console.log("all well");
});
