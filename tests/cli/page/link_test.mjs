// SPDX-License-Identifier: Apache-2.0
// Goal: a link for reading opens the city, and its token is in no address that the browser sends,
//   shows or remembers.
// Method: it drives Chromium to a daemon that asks for tokens.
//
//   node link_test.mjs BASE_URL PATH_OF_LINK [CHROMIUM]
import assert from "node:assert/strict";
import * as browsing from "./browser.mjs";

const [base, path, chromium = "/usr/bin/chromium"] = process.argv.slice(2);
if (!path) {
  console.error("usage: node link_test.mjs BASE_URL PATH_OF_LINK [CHROMIUM]");
  process.exit(2);
}
const secret = path.split("=")[1];
const { browser, page, complaints } = await browsing.openBrowser(base, chromium);
try {
  let asked = 0;
  page.on("request", (request) => {
    ++asked;
    const { url, referer = "" } = { url: request.url(), ...request.headers() };
    // Puppeteer tells the fragment of what is loaded, which the browser sends to nobody.
    assert.ok(!url.split("#")[0].includes(secret), `the token is in an address: ${url}`);
    assert.ok(!referer.includes(secret), "the token is in a referrer");
  });
  await page.goto(base + path, { waitUntil: "load" });
  await page.waitForFunction(
    () => document.querySelectorAll("#panel-photos button[data-photo]").length > 0,
  );
  assert.ok(asked > 3, `${asked} requests were made`);
  assert.equal(await page.$eval("dialog", (node) => node.open), false, "no token is asked for");
  assert.ok(!page.url().includes("#"), `the address shows ${page.url()}`);
  assert.ok(!(await page.evaluate(() => JSON.stringify(history.state))).includes(secret));
  const cookies = await page.evaluate(() => document.cookie);
  assert.equal(cookies, "", "no cookie was set");
  await page.goBack().catch(() => null);
  assert.ok(!page.url().includes(secret), "nor does the history");
  assert.deepEqual(complaints, [], "the browser complained");
  console.log("passed");
} catch (error) {
  console.error(error.stack);
  if (complaints.length > 0) console.error(`the browser said:\n${complaints.join("\n")}`);
  process.exitCode = 1;
} finally {
  await browser.close();
}
