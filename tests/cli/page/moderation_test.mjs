// SPDX-License-Identifier: Apache-2.0
// Goal: whoever may read reports a photo by the keyboard; a curator sees the report, hides the photo,
//   shows it again and erases it, and leaves another one as it is; others do not see what is hidden;
//   axe-core finds nothing serious, in either language.
// Method: it drives Chromium, twice, to a daemon that asks for tokens.
//
//   node moderation_test.mjs BASE_URL VIEWER_TOKEN CURATOR_TOKEN OUT_FOLDER [CHROMIUM]
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import * as browsing from "./browser.mjs";

const [base, viewer, curator, outFolder, chromium = "/usr/bin/chromium"] = process.argv.slice(2);
if (!outFolder) {
  console.error("usage: node moderation_test.mjs BASE_URL VIEWER CURATOR OUT_FOLDER [CHROMIUM]");
  process.exit(2);
}
mkdirSync(outFolder, { recursive: true });

async function openAs(token) {
  const opened = await browsing.openBrowser(base, chromium);
  await opened.page.goto(`${base}/#link=${token}`, { waitUntil: "load" });
  await opened.page.waitForSelector("#panel-photos button[data-photo]");
  return opened;
}

const photos = (page) =>
  page.$$eval("#panel-photos button[data-photo]", (nodes) => nodes.map((one) => one.dataset.photo));

// Waits until the list of photos has the photo, or has it no more.
const waitForPhoto = (page, id, isThere) =>
  page.waitForFunction(
    (photo, wanted) =>
      !!document.querySelector(`#panel-photos button[data-photo="${photo}"]`) === wanted,
    {},
    id,
    isThere,
  );

// Moves the focus there by the tabulator, as somebody without a mouse does.
async function tabTo(page, selector) {
  for (let i = 0; i < 60; ++i) {
    if (await page.evaluate((one) => document.activeElement?.matches(one), selector)) return;
    await page.keyboard.press("Tab");
  }
  assert.fail(`the keyboard does not reach ${selector}`);
}

async function audit(page, where) {
  assert.deepEqual(await browsing.graveFindings(page), [], `axe in ${where}`);
}

async function testReport(page, id, reason, text) {
  await page.focus(`#panel-photos button[data-photo="${id}"]`);
  await page.keyboard.press("Enter");
  await page.waitForSelector('.photo button[data-key="report"]');
  assert.equal(await page.$('.photo button[data-key="hide"]'), null, "viewers hide nothing");
  await tabTo(page, '.photo button[data-key="report"]');
  await page.keyboard.press("Enter");
  await page.waitForSelector("#report-reason", { visible: true });
  await audit(page, "the report's dialog");
  await page.screenshot({ path: join(outFolder, "report.png") });
  await page.select("#report-reason", reason);
  await tabTo(page, "#report-text");
  if (text) await page.keyboard.type(text);
  await tabTo(page, "dialog[open] button[type=submit]");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() =>
    document.querySelector("#status").textContent.includes("A curator will look at it"),
  );
  await page.keyboard.press("Escape");
  await browsing.waitForView(page, "selected", "");
}

const readers = await openAs(viewer);
const curators = await openAs(curator);
try {
  const page = readers.page;
  assert.equal(await page.$eval("#tab-reports", (node) => node.hidden), true, "not for viewers");
  const [first, second] = await photos(page);
  await testReport(page, first, "privacy", "my <b>window</b>");
  await testReport(page, second, "wrong", "");

  const desk = curators.page;
  await desk.waitForFunction(() => !document.querySelector("#tab-reports").hidden);
  await desk.click("#tab-reports");
  await desk.waitForFunction(() => document.querySelectorAll("#reports .card").length === 2);
  const told = await desk.$$eval("#reports .card", (nodes) => nodes.map((one) => one.textContent));
  assert.ok(told[0].includes("my <b>window</b>") && told[0].includes("number plates"), told[0]);
  assert.equal(await desk.$("#reports b"), null, "a hostile text stays text");
  await audit(desk, "the reports");
  await desk.screenshot({ path: join(outFolder, "reports.png") });
  await desk.click("#language");
  await desk.waitForFunction(() =>
    document.querySelector("#reports").textContent.includes("Kennzeichen"),
  );
  await audit(desk, "the reports in German");
  await desk.click("#language");

  await desk.focus('#reports button[data-key="hide_photo-1"]');
  await desk.keyboard.press("Enter");
  await desk.waitForFunction(() => document.querySelectorAll("#reports .card").length === 1);
  await waitForPhoto(page, first, false);
  await desk.focus('#reports button[data-key="dismiss-2"]');
  await desk.keyboard.press("Enter");
  await desk.waitForFunction(() => document.querySelectorAll("#reports .card").length === 0);
  assert.ok((await photos(page)).includes(second), "that photo stays");

  await desk.click("#tab-photos");
  await desk.waitForFunction(
    (id) =>
      document
        .querySelector(`#panel-photos button[data-photo="${id}"]`)
        ?.textContent.includes("hidden"),
    {},
    first,
  );
  await desk.click(`#panel-photos button[data-photo="${first}"]`);
  await desk.waitForFunction(() =>
    document.querySelector('.photo button[data-key="hide"]')?.textContent.includes("again"),
  );
  await audit(desk, "a hidden photo");
  await desk.screenshot({ path: join(outFolder, "hidden.png") });
  await desk.focus('.photo button[data-key="hide"]');
  await desk.keyboard.press("Enter");
  await waitForPhoto(page, first, true);

  await tabTo(desk, '.photo button[data-key="erase"]');
  await desk.keyboard.press("Enter");
  await desk.waitForSelector("#erase-why", { visible: true });
  await audit(desk, "the dialog of erasing");
  await desk.screenshot({ path: join(outFolder, "erase.png") });
  await tabTo(desk, "#erase-why");
  await desk.keyboard.type("somebody's home");
  await tabTo(desk, "dialog[open] button[type=submit]");
  await desk.keyboard.press("Enter");
  await desk.waitForFunction(() =>
    document.querySelector("#status").textContent.includes("is erased"),
  );
  await browsing.waitForView(desk, "selected", "");
  for (const one of [desk, page]) await waitForPhoto(one, first, false);
  for (const { complaints } of [readers, curators])
    assert.deepEqual(complaints, [], "the browser complained");
  console.log("passed");
} catch (error) {
  console.error(error.stack);
  for (const { complaints } of [readers, curators])
    if (complaints.length > 0) console.error(`the browser said:\n${complaints.join("\n")}`);
  process.exitCode = 1;
} finally {
  await readers.browser.close();
  await curators.browser.close();
}
