// A page in a browser, for the scripts beside this one: `look` opens it and ends the program, `watched` collects what goes wrong.
"use strict";
const { chromium } = require("playwright-core");

const QUIET = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];

// Has `see` look at a page of this size in pixels. What it throws is printed, and the exit status is 1.
exports.look = async (program, width, height, see) => {
  try {
    const browser = await chromium.launch({ executablePath: program, args: QUIET });
    const page = await (await browser.newContext({ viewport: { width, height } })).newPage();
    await see(page);
    await browser.close();
  } catch (error) {
    console.log(String((error && error.stack) || error));
    process.exit(1);
  }
};

// Errors and dialogs of the page, and its requests to another address than its own.
exports.watched = (page, address) => {
  const errors = [];
  const foreign = [];
  page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("dialog", (dialog) => { errors.push("dialog: " + dialog.message()); dialog.dismiss(); });
  page.on("request", (request) => { if (!request.url().startsWith(address) && !/^(data|blob):/.test(request.url())) foreign.push(request.url()); });
  return { errors, foreign };
};
