// SPDX-License-Identifier: Apache-2.0
// Goal: the page does in a browser what it promises.
// Method: it drives Chromium against a daemon that runs already and whose city holds most photos of
// a street; PHOTOS_FOLDER holds a few more of them. It leaves screenshots in OUT_FOLDER.
//
//   node page_test.mjs BASE_URL PHOTOS_FOLDER OUT_FOLDER [CHROMIUM] [CAMERA]
//
// CAMERA is the camera of the photos; without it the first one of the city.
import assert from "node:assert/strict";
import { mkdirSync, readdirSync } from "node:fs";
import { join, resolve } from "node:path";
import * as browsing from "./browser.mjs";
import { DESKTOP, settle } from "./browser.mjs";

const [base, photosFolder, outFolder, chromium = "/usr/bin/chromium", camera] =
  process.argv.slice(2);
if (!outFolder) {
  console.error("usage: node page_test.mjs BASE_URL PHOTOS_FOLDER OUT_FOLDER [CHROMIUM] [CAMERA]");
  process.exit(2);
}
mkdirSync(outFolder, { recursive: true });

const PHONE = { width: 375, height: 812, isMobile: true, hasTouch: true, deviceScaleFactor: 2 };

const { browser, page, complaints } = await browsing.openBrowser(base, chromium);

let step = "";
function begin(name) {
  step = name;
  console.log(`- ${name}`);
}

const viewData = (name) => browsing.viewData(page, name);
const waitForView = (name, value) => browsing.waitForView(page, name, value);
const colorsInView = () => browsing.colorsInView(page);
const openTab = (name) => page.click(`#tab-${name}`);

async function cityPhotos() {
  return page.evaluate(async () => (await fetch("/v1/photos?from=1&count=1000")).json());
}

async function audit(where) {
  assert.deepEqual(await browsing.graveFindings(page), [], `axe in ${where}`);
}

async function overflowPx() {
  return page.evaluate(() => {
    let most = document.documentElement.scrollWidth - innerWidth;
    for (const node of document.querySelectorAll("#panel *, .overlay *")) {
      const box = node.getBoundingClientRect();
      // Tabs scroll sideways by design on a phone.
      if (box.width > 0 && !node.closest(".tabs")) most = Math.max(most, box.right - innerWidth);
    }
    return most;
  });
}

async function testLoading() {
  begin("the page loads and draws points and cameras");
  await page.goto(base, { waitUntil: "load" });
  await page.waitForFunction(() => Number(document.querySelector("#view")?.dataset.points) > 0);
  await settle();
  const photos = await cityPhotos();
  const shown = Number(await viewData("reconstruction"));
  const placed = photos.filter((one) => one.reconstruction === shown && one.center);
  assert.equal(Number(await viewData("cameras")), placed.length, "a camera for each placed photo");
  const bytes = await page.evaluate(async (id) => {
    return (await (await fetch(`/v1/reconstructions/${id}/points`)).arrayBuffer()).byteLength;
  }, shown);
  assert.equal(Number(await viewData("points")), bytes / 16, "all points");
  assert.equal(Number(await viewData("drawn")), bytes / 16, "all points are drawn while still");
  const colors = await colorsInView();
  assert.ok(colors > 100, `the view shows ${colors} colours`);
  await page.screenshot({ path: join(outFolder, "desktop.png") });
}

// Gives the number of the first photo that has a neighbour.
async function testPhotoPanel() {
  begin("a photo of the list shows its thumbnail and its neighbours");
  const shown = Number(await viewData("reconstruction"));
  const all = await cityPhotos();
  const first = all.find((one) => one.reconstruction === shown && one.center);
  assert.ok(first, "a placed photo");
  await page.click(`#panel-photos button[data-photo="${first.id}"]`);
  await waitForView("selected", String(first.id));
  await page.waitForFunction(() => {
    const image = document.querySelector(".photo .thumbnail img");
    return image && image.complete && image.naturalWidth > 0;
  });
  const neighbors = await page.$$eval(".photo .neighbors button[data-photo]", (nodes) =>
    nodes.map((node) => node.dataset.photo),
  );
  assert.ok(neighbors.length > 0, "the photo has neighbours");
  const text = await page.$eval(".photo", (node) => node.textContent);
  assert.ok(text.includes(first.image), "its name is told");
  await page.screenshot({ path: join(outFolder, "photo.png") });
  await audit("the photo's panel");

  begin("a neighbour is selected by its button");
  await page.click(`.photo .neighbors button[data-photo="${neighbors[0]}"]`);
  await waitForView("selected", neighbors[0]);
  await page.waitForFunction(
    (id) => !document.querySelector(`.photo .neighbors button[data-photo="${id}"]`),
    {},
    neighbors[0],
  );
  return first.id;
}

async function testClick(id) {
  begin("a click on a camera in the view selects its photo");
  await page.keyboard.press("Escape");
  await waitForView("selected", "");
  await page.click(`#panel-photos button[data-photo="${id}"]`);
  await waitForView("selected", String(id));
  await settle();
  const [x, y] = [Number(await viewData("markerX")), Number(await viewData("markerY"))];
  assert.ok(x > 0 && y > 0, "the selected camera is in sight");
  await page.keyboard.press("Escape");
  await waitForView("selected", "");
  await page.mouse.click(x, y);
  await waitForView("selected", String(id));
}

async function testFlight() {
  begin("flying into the photo lays it over the model, and Escape leaves");
  await page.waitForSelector('.photo button[data-key="fly"]');
  await page.click('.photo button[data-key="fly"]');
  await waitForView("mode", "photo");
  await settle(1500);
  await page.screenshot({ path: join(outFolder, "flight.png") });
  const before = await colorsInView();
  await page.$eval("#opacity", (slider) => {
    slider.value = "0";
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  });
  await settle();
  await page.screenshot({ path: join(outFolder, "flight_model.png") });
  const after = await colorsInView();
  assert.ok(before > 2 * after, `with the photo ${before} colours, without ${after}`);
  await page.keyboard.press("Escape");
  await waitForView("mode", "model");
  assert.equal(await page.evaluate(() => document.activeElement.id), "view", "the focus stays");
  assert.notEqual(await viewData("selected"), "", "the photo is selected still");
  await settle(1200);
  await page.keyboard.press("Escape");
  await waitForView("selected", "");
}

async function testKeys() {
  begin("the keyboard turns the view and moves between tabs");
  await page.click("#panel-photos button[data-photo]");
  await settle();
  const before = await viewData("markerX");
  await page.focus("#view");
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("ArrowLeft");
  await settle();
  assert.notEqual(await viewData("markerX"), before, "the view has turned");
  await page.keyboard.press("Home");
  await page.keyboard.press("Escape");
  await waitForView("selected", "");
  await page.focus("#tab-photos");
  await page.keyboard.press("ArrowRight");
  assert.equal(await page.evaluate(() => document.activeElement.id), "tab-reconstructions");
  await page.waitForSelector("#panel-reconstructions button[aria-current]", { visible: true });
  await openTab("seams");
  await page.waitForSelector("#panel-seams .rows li", { visible: true });
  await openTab("history");
  await page.waitForSelector("#history li", { visible: true });
  const count = await page.$$eval("#history li", (nodes) => nodes.length);
  assert.ok(count > 5, `the history has ${count} entries`);
  await openTab("photos");
}

async function testSearch() {
  begin("the search finds a photo by its name");
  const { image } = (await cityPhotos()).at(-1);
  await page.type("#search", image.toUpperCase());
  await page.waitForFunction(
    () => document.querySelectorAll("#panel-photos button[data-photo]").length === 1,
  );
  assert.ok((await page.$eval("#panel-photos .rows", (node) => node.textContent)).includes(image));
  await page.$eval("#search", (input) => {
    input.value = "";
    input.dispatchEvent(new Event("input"));
  });

  begin("a row that did not change stays under the pointer while the list is filled anew");
  const rows = await page.evaluate((name) => {
    const list = () => [...document.querySelectorAll("#panel-photos .rows > li")];
    const before = list();
    const fill = (words) => {
      document.querySelector("#search").value = words;
      document.querySelector("#search").dispatchEvent(new Event("input"));
      return list();
    };
    const again = fill("");
    const found = fill(name);
    const all = fill("");
    return {
      isSame: again.every((node, i) => node === before[i]),
      isFound: found.length === 1 && before.includes(found[0]),
      names: [before, again, all].map((nodes) => nodes.map((node) => node.textContent).join()),
    };
  }, image);
  assert.ok(rows.isSame && rows.isFound, "rows were built anew");
  assert.equal(new Set(rows.names).size, 1, "the order of the rows changed");
}

async function testUpload() {
  begin("photos are sent, their way is told, and their cameras appear");
  const names = readdirSync(photosFolder).filter((name) => /\.jpe?g$/i.test(name));
  assert.ok(names.length > 0, "PHOTOS_FOLDER has photos");
  const known = (await cityPhotos()).length;
  const history = Number(await page.$$eval("#history li", (nodes) => nodes.length));
  await openTab("contribute");
  await page.$eval("#contributor", (input) => {
    input.value = "<b>page test</b>";
    input.dispatchEvent(new Event("change"));
  });
  const cameras = await page.$$eval("#camera option", (nodes) => nodes.map((node) => node.value));
  await page.select("#camera", camera ?? cameras[1] ?? "");
  await page.type("#comment", "a walk <b>by the river</b>");
  await page.type("#licence", "CC-BY-4.0");
  await page.evaluate(() => {
    window.stages = [];
    new MutationObserver(() => {
      for (const row of document.querySelectorAll("#uploads li")) {
        window.stages.push(row.dataset.stage);
      }
    }).observe(document.querySelector("#uploads"), { subtree: true, childList: true });
  });
  const input = await page.$("#files");
  await input.uploadFile(...names.map((name) => resolve(photosFolder, name)));
  await page.waitForFunction(
    (count) => {
      const rows = [...document.querySelectorAll("#uploads li")];
      const over = ["judged", "refused", "unknown"];
      return rows.length === count && rows.every((row) => over.includes(row.dataset.stage));
    },
    {},
    names.length,
  );
  const stages = new Set(await page.evaluate(() => window.stages));
  for (const stage of ["sending", "waiting", "judged"]) assert.ok(stages.has(stage), stage);
  const verdicts = await page.$$eval("#uploads li", (rows) => rows.map((r) => r.dataset.verdict));
  console.log(`  ${verdicts.join(", ")}`);
  const placed = verdicts.filter((one) => ["placed", "merged", "founded"].includes(one));
  assert.ok(placed.length > 0, `one of the photos is placed: ${verdicts}`);
  assert.equal(await page.$("#uploads b"), null, "a hostile name stays text");

  const photos = await cityPhotos();
  assert.equal(photos.length, known + names.length, "the city has them all");
  const contributions = () =>
    page.evaluate(async () => (await fetch("/v1/contributions")).json());
  for (let i = 0; (await contributions())[0]?.closed === null; ++i) {
    assert.ok(i < 60, "the contribution is closed");
    await settle(100);
  }
  const [{ comment, licence, photos: sent }] = await contributions();
  const remarks = ["a walk <b>by the river</b>", "CC-BY-4.0"];
  assert.deepEqual([comment, licence, sent], [...remarks, names.length]);
  const shown = () => viewData("reconstruction").then(Number);
  const hasAll = async () => {
    const id = await shown();
    const placed = (await cityPhotos()).filter((p) => p.reconstruction === id && p.center);
    const listed = await page.$$eval("#panel-photos button[data-photo]", (nodes) => nodes.length);
    return (
      Number(await viewData("cameras")) === placed.length &&
      listed === Math.min(200, known + names.length)
    );
  };
  for (let i = 0; !(await hasAll()); ++i) {
    assert.ok(i < 60, "the new cameras appear without reloading");
    await settle(500);
  }
  assert.ok((await page.$$("#history li")).length > history, "the history has grown by events");
  assert.equal(await page.$("#history b"), null, "a hostile contributor stays text");

  begin("a new photo is shown by its button");
  const show = await page.waitForSelector("#uploads li .chip");
  await show.click();
  await page.waitForFunction(() => {
    const image = document.querySelector(".photo .thumbnail img");
    return document.querySelector("#view").dataset.selected !== "" && image?.naturalWidth > 0;
  });
  const facts = await page.$eval(".photo dl", (node) => node.textContent);
  for (const one of remarks) assert.ok(facts.includes(one), `${one} is told of the photo`);
  await page.click(".photo .back");
  await waitForView("selected", "");

  begin("a photo that is there already, and a file that is none");
  await openTab("contribute");
  await input.uploadFile(resolve(photosFolder, names[0]), resolve(process.argv[1]));
  await page.waitForFunction(
    (count) => {
      const rows = [...document.querySelectorAll("#uploads li")];
      const over = ["judged", "refused"];
      return rows.length === count && rows.every((row) => over.includes(row.dataset.stage));
    },
    {},
    names.length + 2,
  );
  const last = await page.$$eval("#uploads li", (rows) =>
    rows.slice(0, 2).map((row) => [row.dataset.stage, row.dataset.verdict, row.textContent]),
  );
  console.log(`  ${JSON.stringify(last)}`);
  assert.ok(
    last.some(([, verdict]) => verdict === "duplicate"),
    "the duplicate is told",
  );
  assert.ok(
    last.some(([stage, verdict]) => stage === "refused" || verdict === "rejected"),
    "the file that is no photo is refused",
  );
  await page.screenshot({ path: join(outFolder, "contribute.png") });
  await audit("the contributions");
  // Answers 409 and 422 are expected here.
  const isExpected = (one) => /^(409|422) |status of (409|422)/.test(one);
  complaints.splice(0, Infinity, ...complaints.filter((one) => !isExpected(one)));
}

async function testLanguage() {
  begin("the switch changes the language");
  await openTab("photos");
  const label = () => page.$eval("#tab-contribute", (node) => node.textContent);
  assert.equal(await label(), "Contribute");
  await page.click("#language");
  assert.equal(await label(), "Beitragen");
  assert.equal(await page.evaluate(() => document.documentElement.lang), "de");
  assert.ok((await page.$eval("#panel-photos", (node) => node.textContent)).includes("verortet"));
  assert.ok((await overflowPx()) <= 0, "German fits");
  await page.screenshot({ path: join(outFolder, "german.png") });
  await page.click("#language");
  assert.equal(await label(), "Contribute");
}

async function testLooks() {
  for (const scheme of ["light", "dark"]) {
    await page.emulateMediaFeatures([
      { name: "prefers-color-scheme", value: scheme },
      { name: "prefers-reduced-motion", value: "reduce" },
    ]);
    begin(`nobody is left out: desktop, ${scheme}`);
    await page.setViewport(DESKTOP);
    await settle();
    for (const tab of ["photos", "reconstructions", "seams", "history", "contribute"]) {
      await openTab(tab);
      await audit(`${tab}, desktop, ${scheme}`);
    }
    await openTab("photos");
    if (scheme === "dark") await page.screenshot({ path: join(outFolder, "dark.png") });

    begin(`nobody is left out: phone, ${scheme}`);
    await page.setViewport(PHONE);
    await settle();
    for (const tab of ["reconstructions", "seams", "history", "contribute", "photos"]) {
      await openTab(tab);
      assert.ok((await overflowPx()) <= 0, `${tab} overflows by ${await overflowPx()} px`);
      await audit(`${tab}, phone, ${scheme}`);
    }
    if (scheme === "light") await page.screenshot({ path: join(outFolder, "phone.png") });
    const open = await page.$eval("#panel", (node) => node.getBoundingClientRect().height);
    await page.click("#fold");
    await settle();
    const folded = await page.$eval("#panel", (node) => node.getBoundingClientRect().height);
    assert.ok(folded < 80 && open > 300, `the panel folds from ${open} to ${folded} px`);
    await page.screenshot({ path: join(outFolder, `phone_folded_${scheme}.png`) });
    await page.click("#fold");

    await page.click("#panel-photos button[data-photo]");
    await page.waitForFunction(
      () => document.querySelector(".photo .thumbnail img")?.naturalWidth > 0,
    );
    await settle();
    assert.ok((await overflowPx()) <= 0, "the photo's panel overflows");
    await audit(`a photo, phone, ${scheme}`);
    const fly = await page.$('.photo button[data-key="fly"]');
    if (fly) {
      await fly.click();
      await waitForView("mode", "photo");
      await settle();
      assert.ok((await overflowPx()) <= 0, "the photo's bar overflows");
      await audit(`in a photo, phone, ${scheme}`);
      await page.screenshot({ path: join(outFolder, `phone_flight_${scheme}.png`) });
      await page.click("#leave");
      await page.click("#fold");
    }
    await page.click(".photo .back");
    await waitForView("selected", "");
  }
}

// In place of the daemon's points, many that come in two parts, the second one when it is asked for;
// the first part ends within a point.
async function testManyPoints() {
  begin("many points are shown before all of them have come");
  const [first, all] = [150_000, 400_000];
  await page.setViewport(DESKTOP);
  const script = await page.evaluateOnNewDocument(
    (early, count) => {
      const bytes = new Uint8Array(16 * count);
      const view = new DataView(bytes.buffer);
      for (let i = 0; i < count; ++i) {
        for (let k = 0; k < 3; ++k) view.setFloat32(16 * i + 4 * k, Math.random() - 0.5, true);
        bytes.set([i % 251, i % 241, i % 239], 16 * i + 12);
      }
      const asked = window.fetch;
      window.fetch = (path, ...rest) => {
        if (!String(path).endsWith("/points")) return asked(path, ...rest);
        const body = new ReadableStream({
          start(parts) {
            parts.enqueue(bytes.slice(0, 16 * early + 7));
            window.goOn = () => {
              parts.enqueue(bytes.slice(16 * early + 7));
              parts.close();
            };
          },
        });
        return Promise.resolve(new Response(body));
      };
    },
    first,
    all,
  );
  await page.goto(base, { waitUntil: "load" });
  await waitForView("points", String(first));
  await settle(1000);
  assert.equal(Number(await viewData("drawn")), first, "what has come is drawn");
  assert.ok(Number(await viewData("cameras")) > 0, "with the cameras");
  await page.evaluate(() => window.goOn());
  await waitForView("points", String(all));
  await waitForView("drawn", String(all));
  await page.removeScriptToEvaluateOnNewDocument(script.identifier);
}

try {
  await testLoading();
  const id = await testPhotoPanel();
  await testClick(id);
  await testFlight();
  await testKeys();
  await testSearch();
  await testUpload();
  await testLanguage();
  await testLooks();
  await testManyPoints();
  begin("nothing was complained about");
  assert.deepEqual(await page.evaluate(() => window.violations), [], "the policy was violated");
  assert.deepEqual(complaints, [], "the browser complained");
  console.log("passed");
} catch (error) {
  console.error(`failed: ${step}\n${error.stack}`);
  if (complaints.length > 0) console.error(`the browser said:\n${complaints.join("\n")}`);
  await page.screenshot({ path: join(outFolder, "failed.png") }).catch(() => {});
  process.exitCode = 1;
} finally {
  await browser.close();
}
