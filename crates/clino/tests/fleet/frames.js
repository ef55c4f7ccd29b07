// Frames per second of the live page: node frames.js CHROMIUM ADDRESS SENSORS SECONDS. Prints {"fps":…,"changes":…}.
"use strict";
const { look } = require("./look");

const [program, address, sensors, seconds] = process.argv.slice(2);

look(program, 1280, 900, async (page) => {
  await page.goto(address);
  await page.waitForFunction((count) => document.querySelectorAll(".sensor .angle").length === count, Number(sensors), { timeout: 60000 });
  const figures = await page.evaluate(async (seconds) => {
    let frames = 0;
    let changes = 0;
    new MutationObserver((all) => { changes += all.length; }).observe(document.getElementById("gateways"), { subtree: true, childList: true, characterData: true });
    const began = performance.now();
    while (performance.now() - began < seconds * 1000) {
      await new Promise(requestAnimationFrame);
      frames += 1;
    }
    const passed = (performance.now() - began) / 1000;
    return { fps: frames / passed, changes: changes / passed };
  }, Number(seconds));
  console.log(JSON.stringify(figures));
});
