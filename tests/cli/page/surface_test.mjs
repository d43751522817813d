// SPDX-License-Identifier: Apache-2.0
// Goal: the dense surface appears in the page when it is made, is drawn coarse and fine, can be
// switched, and changes when the city does; flying into a photo works with it.
// Method: it drives Chromium against a daemon that runs already and keeps the city dense; the
// surface need not be there yet. One photo that is not in the city yet is sent. Screenshots are
// left in OUT_FOLDER.
//
//   node surface_test.mjs BASE_URL PHOTO OUT_FOLDER CHROMIUM
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join, resolve } from "node:path";
import * as browsing from "./browser.mjs";
import { settle } from "./browser.mjs";

const [base, photo, outFolder, chromium] = process.argv.slice(2);
if (!chromium) {
  console.error("usage: node surface_test.mjs BASE_URL PHOTO OUT_FOLDER CHROMIUM");
  process.exit(2);
}
mkdirSync(outFolder, { recursive: true });
const { browser, page, complaints } = await browsing.openBrowser(base, chromium);
const DENSE_MS = 240_000; // a pass over a few photos takes seconds, on a busy machine more

let step = "";
function begin(name) {
  step = name;
  console.log(`- ${name}`);
}
const viewData = (name) => browsing.viewData(page, name);
const waitForView = (name, value) => browsing.waitForView(page, name, value);
const shoot = (name) => page.screenshot({ path: join(outFolder, `${name}.png`) });
const triangles = async () => Number(await viewData("triangles"));

// Addresses of all tiles that the page has asked for.
const fetched = new Set();
page.on("request", (request) => {
  if (request.url().endsWith(".glb")) fetched.add(request.url());
});

// Of all that is drawn: another surface has another one. (The tileset changes with the place on the
// earth as well.)
const rootName = () =>
  page.evaluate(async () => {
    const id = document.querySelector("#view").dataset.reconstruction;
    const answer = await fetch(`/v1/reconstructions/${id}/surface/tileset.json`);
    return (await answer.json()).root.content.uri;
  });

// The pass commits tile by tile: what the page shows in the end is the surface as it is then.
async function waitForFinishedSurface() {
  const isFinished = async () => {
    const state = await page.evaluate(async () => (await (await fetch("/v1/dense")).json()).state);
    const name = await rootName();
    return (
      state === "waiting" &&
      [...fetched].some((url) => url.endsWith(name)) &&
      (await viewData("surface")) === "complete"
    );
  };
  const begun = Date.now();
  while (!(await isFinished())) {
    assert.ok(Date.now() - begun < DENSE_MS, "the page shows the surface of a finished pass");
    await settle(200);
  }
}

async function testAppears() {
  begin("the surface appears when it is made, without reloading");
  await page.goto(base, { waitUntil: "load" });
  await page.waitForFunction(() => Number(document.querySelector("#view")?.dataset.points) > 0);
  await page.waitForFunction(
    () => document.querySelector("#view").dataset.surface === "complete",
    { timeout: DENSE_MS },
  );
  await waitForFinishedSurface();
  await settle();
  assert.ok((await triangles()) > 1000, `${await triangles()} triangles are drawn`);
  assert.ok(Number(await viewData("tiles")) > 0, "in tiles");
  assert.ok(Number(await viewData("drawn")) > 0, "with the points");
  await shoot("surface_both");
}

async function testSwitch() {
  begin("points, surface or both are switched, also by the keyboard");
  await page.click('label[for="layer-points"]');
  await waitForView("triangles", "0");
  assert.ok(Number(await viewData("drawn")) > 0);
  const pointColors = await browsing.colorsInView(page);
  await page.focus("#layer-points");
  await page.keyboard.press("ArrowRight");
  assert.equal(await page.evaluate(() => document.activeElement.id), "layer-surface");
  await waitForView("drawn", "0");
  await waitForView("surface", "complete");
  assert.ok((await triangles()) > 1000);
  assert.ok((await browsing.colorsInView(page)) > pointColors, "a surface has more colours");
  assert.deepEqual(await browsing.graveFindings(page), [], "axe");
  await shoot("surface");
  await page.click("#language");
  const label = await page.$eval('label[for="layer-surface"]', (node) => node.textContent);
  assert.equal(label, "Oberfläche");
  await page.click("#language");
}

async function testDetail() {
  begin("from afar less is drawn than from near");
  await page.focus("#view");
  await page.keyboard.press("Home");
  await settle();
  await waitForView("surface", "complete");
  const whole = await triangles();
  for (let i = 0; i < 25; ++i) await page.keyboard.press("-");
  await settle();
  await waitForView("surface", "complete");
  const far = await triangles();
  assert.ok(far < whole / 2, `${far} from afar, ${whole} before`);
  await page.keyboard.press("Home");
  await settle();
  await waitForView("surface", "complete");
  assert.equal(await triangles(), whole, "the same view draws the same again");

  begin("the plan draws it as well, less of it from afar, and nothing of it is left behind");
  await page.keyboard.press("p");
  await waitForView("mode", "plan");
  await settle();
  await waitForView("surface", "complete");
  const above = await triangles();
  assert.ok(above > 1000, `${above} triangles are drawn from above`);
  await shoot("surface_plan");
  for (let i = 0; i < 20; ++i) await page.keyboard.press("-");
  await settle();
  await waitForView("surface", "complete");
  assert.ok((await triangles()) < above / 2, `${await triangles()} from afar, ${above} before`);
  await page.keyboard.press("p");
  await waitForView("mode", "model");
  await settle();
  await waitForView("surface", "complete");
  assert.equal(await triangles(), whole, "the same view draws the same again");

  begin("nothing is drawn anew while nothing changes");
  const frames = await page.evaluate(async () => {
    let count = 0;
    const observer = new MutationObserver(() => ++count);
    observer.observe(document.querySelector("#view"), { attributes: true });
    await new Promise((done) => setTimeout(done, 1500));
    observer.disconnect();
    return count;
  });
  // Each frame writes a handful of attributes.
  assert.ok(frames < 40, `${frames} changes in one and a half seconds of rest`);
}

async function testFlight() {
  begin("a photo is flown into, before the surface");
  await page.click("#panel-photos button[data-photo]");
  const fly = await page.waitForSelector('.photo button[data-key="fly"]');
  await fly.click();
  await waitForView("mode", "photo");
  await settle(1500);
  await page.$eval("#opacity", (slider) => {
    slider.value = "0";
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  });
  await waitForView("surface", "complete");
  await settle();
  assert.ok((await triangles()) > 1000);
  await shoot("surface_flight");
  await page.keyboard.press("Escape");
  await waitForView("mode", "model");
  await settle(1200);
  await page.keyboard.press("Escape");
  await waitForView("selected", "");
}

async function testPhone() {
  begin("the switch fits on a phone, light and dark");
  await page.setViewport({ width: 375, height: 812, isMobile: true, hasTouch: true });
  for (const scheme of ["dark", "light"]) {
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    await settle();
    const right = await page.$eval(".layers", (node) => node.getBoundingClientRect().right);
    assert.ok(right <= 375, `it ends at ${right} px`);
    assert.deepEqual(await browsing.graveFindings(page), [], "axe");
    await shoot(`surface_phone_${scheme}`);
  }
  await page.setViewport(browsing.DESKTOP);
  await settle();
}

async function testGrows() {
  begin("one photo more changes the surface in the page");
  const before = await rootName();
  await page.click("#tab-contribute");
  const cameras = await page.$$eval("#camera option", (nodes) => nodes.map((node) => node.value));
  await page.select("#camera", cameras[1]);
  const sent = Date.now();
  fetched.clear();
  await (await page.$("#files")).uploadFile(resolve(photo));
  await page.waitForFunction(
    () => document.querySelector("#uploads li")?.dataset.verdict === "placed",
  );
  while ((await rootName()) === before) {
    assert.ok(Date.now() - sent < DENSE_MS, "the surface changes");
    await settle(500);
  }
  await waitForFinishedSurface();
  console.log(`  ${fetched.size} tiles were fetched, ${(Date.now() - sent) / 1000} s after it`);
  assert.ok((await triangles()) > 1000);
  await shoot("surface_grown");
}

try {
  await testAppears();
  await testSwitch();
  await testDetail();
  await testFlight();
  await testPhone();
  await testGrows();
  begin("nothing was complained about");
  assert.deepEqual(await page.evaluate(() => window.violations), [], "the policy was violated");
  // A tile that has changed since the tileset was read is not there any more.
  const isSuperseded = (one) =>
    /^404 .*\.glb$|status of 404|Failed to load tile at|no tile '/.test(one);
  assert.deepEqual(
    complaints.filter((one) => !isSuperseded(one)),
    [],
    "the browser complained",
  );
  console.log("passed");
} catch (error) {
  console.error(`failed: ${step}\n${error.stack}`);
  if (complaints.length > 0) console.error(`the browser said:\n${complaints.join("\n")}`);
  await shoot("failed").catch(() => {});
  process.exitCode = 1;
} finally {
  await browser.close();
}
