// SPDX-License-Identifier: Apache-2.0
// Goal: the plan looks straight down, with north up and a scale where the city's place on the earth
// is known; it is moved and zoomed and never turned; leaving it goes back to the view before.
// Method: it drives Chromium against a daemon that runs already, and compares where photos are drawn
// with where the daemon says that they are. Screenshots are left in OUT_FOLDER.
//
//   node plan_test.mjs BASE_URL known|unknown OUT_FOLDER CHROMIUM
//
// Known: each reconstruction has a place on the earth, and there are two at least. Unknown: none has
// one.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import * as browsing from "./browser.mjs";
import { DESKTOP, settle } from "./browser.mjs";

const [base, place, outFolder, chromium] = process.argv.slice(2);
if (!chromium || !["known", "unknown"].includes(place)) {
  console.error("usage: node plan_test.mjs BASE_URL known|unknown OUT_FOLDER CHROMIUM");
  process.exit(2);
}
mkdirSync(outFolder, { recursive: true });
const isKnown = place === "known";
const PHONE = { width: 375, height: 812, isMobile: true, hasTouch: true, deviceScaleFactor: 2 };
const NEAR_PX = 1.5; // markers are told to 0.1 px, and the mouse moves by whole ones
const METRES_MIN = 1; // a camera is drawn as a pyramid, whose middle is before the lens
const PAN_PX = 60; // PAN_PX of city_view.ts

const { browser, page, complaints } = await browsing.openBrowser(base, chromium);

let step = "";
function begin(name) {
  step = name;
  console.log(`- ${name}`);
}
const viewData = (name) => browsing.viewData(page, name);
const waitForView = (name, value) => browsing.waitForView(page, name, value);
const shoot = (name) => page.screenshot({ path: join(outFolder, `plan_${place}_${name}.png`) });
const isPressed = () => page.$eval("#plan", (node) => node.getAttribute("aria-pressed"));
const legend = () => page.$eval(".legend", (node) => node.innerText.trim());

async function waitForPoints() {
  await page.waitForFunction(() => Number(document.querySelector("#view")?.dataset.points) > 0);
  await settle();
}

// The page is loaded anew where the other one has fingers and this one has none, and the reverse.
async function setViewport(viewport) {
  await page.setViewport(viewport);
  await waitForPoints();
}

async function photosByModel() {
  const photos = await page.evaluate(async () =>
    (await (await fetch("/v1/photos?from=1&count=1000")).json()).filter((one) => one.center),
  );
  const ids = [...new Set(photos.map((one) => one.reconstruction))];
  return ids.map((id) => photos.filter((one) => one.reconstruction === id));
}

// Where a photo is drawn, in px.
async function markerOf(id) {
  if (await page.$eval(".tabs", (node) => node.hidden)) await page.click(".photo .back");
  await page.click(`#panel-photos button[data-photo="${id}"]`);
  await waitForView("selected", String(id));
  return marker();
}

async function marker() {
  await settle(350); // until the view is still
  const at = [Number(await viewData("markerX")), Number(await viewData("markerY"))];
  assert.ok(at[0] > 0 && at[1] > 0, `the photo is in sight at ${at}`);
  return at;
}

function assertNear(found, wanted, words) {
  const away = Math.hypot(found[0] - wanted[0], found[1] - wanted[1]);
  assert.ok(away < NEAR_PX, `${words}: ${found} and not ${wanted}`);
}

// Longitude and latitude of a photo.
async function placeOf(id) {
  const { latitude, longitude } = await page.evaluate(
    async (photo) => (await (await fetch(`/v1/photos/%23${photo}/pose`)).json()).on_earth,
    id,
  );
  return [longitude, latitude];
}

// Metres to the east and to the north from one place to another, to 1 %.
function metresBetween(from, to) {
  const degree = 111_320;
  const shrinks = Math.cos((from[1] * Math.PI) / 180);
  return [(to[0] - from[0]) * degree * shrinks, (to[1] - from[1]) * degree];
}

async function pxOfMetre() {
  return page.$eval(".scale", (node) => {
    const width = node.querySelector(".scale-bar").getBoundingClientRect().width;
    return width / Number(node.dataset.metres);
  });
}

async function openPage() {
  begin("the page loads");
  await page.goto(base, { waitUntil: "load" });
  await waitForPoints();
  assert.equal(await legend(), "", "there is no legend beside the model");
}

async function testButton(id) {
  begin("a button shows the plan, and a key leaves it: the view is where it was");
  const before = await markerOf(id);
  await page.click("#plan");
  await waitForView("mode", "plan");
  assert.equal(await isPressed(), "true");
  assert.ok(Math.hypot(...(await marker()).map((x, k) => x - before[k])) > 20, "it is elsewhere");
  await page.focus("#view");
  await page.keyboard.press("p");
  await waitForView("mode", "model");
  assert.equal(await isPressed(), "false");
  assertNear(await marker(), before, "the view is where it was");
  assert.equal(await legend(), "", "there is no legend beside the model");
  await page.keyboard.press("p");
  await waitForView("mode", "plan");
  assert.ok((await browsing.colorsInView(page)) > 100, "points are drawn");
}

async function testNorthIsUp(photos) {
  begin(`${photos.length} photos stand as on a map, north up and east to the right`);
  const seen = [];
  for (const { id } of photos) seen.push([await markerOf(id), await placeOf(id)]);
  assert.match(await legend(), /^North is up\s+\d+ c?m$/);
  const scale = await pxOfMetre();
  let [compared, longest] = [0, 0];
  for (const [px, from] of seen) {
    for (const [otherPx, to] of seen) {
      const [east, north] = metresBetween(from, to);
      const [right, down] = [0, 1].map((k) => otherPx[k] - px[k]);
      if (north > METRES_MIN) assert.ok(down < 0, `${north} m to the north, ${-down} px up`);
      if (east > METRES_MIN) assert.ok(right > 0, `${east} m to the east, ${right} px right`);
      compared += north > METRES_MIN && east > METRES_MIN ? 1 : 0;
      longest = Math.max(longest, Math.hypot(east, north));
      const off = Math.hypot(right - scale * east, -down - scale * north);
      assert.ok(off < METRES_MIN * scale, `${off} px off, at ${scale} px per metre`);
    }
  }
  assert.ok(compared > 0, "one of two photos is farther north and farther east");
  console.log(`  ${longest.toFixed(1)} m, ${scale.toFixed(1)} px per metre`);
  const width = await page.$eval(".scale-bar", (node) => node.getBoundingClientRect().width);
  assert.ok(width > 40 && width <= 120, `the bar takes ${width} px`);
}

async function testUnknown() {
  begin("where the place is not known the plan says so, and has no scale");
  assert.match(await legend(), /^North is not known yet$/);
  assert.ok(await page.$eval(".scale", (node) => node.hidden));
}

async function testMouse(id, otherId) {
  begin("the mouse moves the plan and its wheel zooms it at the pointer; nothing turns it");
  const other = await markerOf(otherId);
  const first = await markerOf(id);
  const ground = [300, 120];
  for (const [button, modifier] of [
    ["left", null],
    ["right", null],
    ["left", "Control"],
  ]) {
    const before = await marker();
    await page.mouse.move(...ground);
    if (modifier) await page.keyboard.down(modifier);
    await page.mouse.down({ button });
    await page.mouse.move(ground[0] + 40, ground[1] + 25, { steps: 4 });
    await page.mouse.up({ button });
    if (modifier) await page.keyboard.up(modifier);
    const moved = modifier ? [0, 0] : [40, 25];
    const wanted = [before[0] + moved[0], before[1] + moved[1]];
    assertNear(await marker(), wanted, `dragged with ${button} ${modifier ?? ""}`);
  }
  assertNear(await marker(), [first[0] + 80, first[1] + 50], "twice by 40, 25");
  assertNear(await markerOf(otherId), [other[0] + 80, other[1] + 50], "all moves as one");

  const at = await markerOf(id);
  await page.mouse.move(Math.round(at[0]), Math.round(at[1]));
  const before = isKnown ? await pxOfMetre() : 0;
  await page.mouse.wheel({ deltaY: -300 });
  assertNear(await marker(), at, "what is under the pointer stays there");
  if (isKnown) {
    const after = await pxOfMetre();
    assert.ok(after > 1.1 * before, `from ${before} to ${after} px per metre`);
  }
  await page.click('[data-words="overview"]');
  assertNear(await markerOf(id), first, "all is shown again");
  assertNear(await markerOf(otherId), other, "all is shown again");
}

async function testKeys(id) {
  begin("the keys move and zoom the plan");
  const first = await markerOf(id);
  await page.focus("#view");
  for (const [key, x, y] of [
    ["ArrowRight", -PAN_PX, 0],
    ["ArrowDown", 0, -PAN_PX],
    ["ArrowLeft", PAN_PX, 0],
    ["ArrowUp", 0, PAN_PX],
  ]) {
    const before = await marker();
    await page.keyboard.press(key);
    assertNear(await marker(), [before[0] + x, before[1] + y], key);
  }
  await page.keyboard.press("-");
  const small = await marker();
  await page.keyboard.press("+");
  assertNear(await marker(), first, "minus and plus");
  assert.ok(Math.hypot(small[0] - first[0], small[1] - first[1]) > NEAR_PX, "minus zooms");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Home");
  assertNear(await marker(), first, "Home shows all");
  assert.equal(await viewData("mode"), "plan", "and stays in the plan");
}

async function testPhoto(id) {
  begin("a click on a camera selects it; a photo is flown into, and left into the plan again");
  const at = await markerOf(id);
  await page.keyboard.press("Escape");
  await waitForView("selected", "");
  assert.equal(await viewData("mode"), "plan");
  await page.mouse.click(...at);
  await waitForView("selected", String(id));
  await (await page.waitForSelector('.photo button[data-key="fly"]')).click();
  await waitForView("mode", "photo");
  await settle(1200);
  assert.equal(await legend(), "", "there is no legend beside a photo");
  await page.focus("#view");
  await page.keyboard.press("p");
  assert.equal(await viewData("mode"), "photo", "there is no plan of a photo");
  await page.keyboard.press("Escape");
  await waitForView("mode", "plan");
  assertNear(await marker(), at, "the plan is as it was");
}

// Two fingers at the same distance from `at`, on a line across.
async function pinch([x, y], from, to) {
  const left = await page.touchscreen.touchStart(x - from, y);
  const right = await page.touchscreen.touchStart(x + from, y);
  for (let k = 1; k <= 4; ++k) {
    const reach = from + ((to - from) * k) / 4;
    await left.move(x - reach, y);
    await right.move(x + reach, y);
  }
  await left.end();
  await right.end();
}

async function testTouch(id) {
  begin("one finger moves the plan, two zoom it");
  await setViewport(PHONE);
  await page.click("#plan");
  await waitForView("mode", "plan");
  const before = await markerOf(id);
  const finger = await page.touchscreen.touchStart(60, 60);
  for (let k = 1; k <= 4; ++k) await finger.move(60 + 5 * k, 60 + 3 * k);
  await finger.end();
  const moved = [before[0] + 20, before[1] + 12];
  assertNear(await marker(), moved, "one finger");
  if (isKnown) {
    const scale = await pxOfMetre();
    await pinch(moved.map(Math.round), 30, 60);
    assertNear(await marker(), moved, "what is between the fingers stays there");
    const grown = (await pxOfMetre()) / scale;
    assert.ok(Math.abs(grown - 2) < 0.3, `twice the distance, ${grown} times the scale`);
  }
  await page.click(".photo .back");
  await waitForView("selected", "");
  await page.click("#plan");
  await waitForView("mode", "model");
}

async function testLooks() {
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "light" }]);
  for (const scheme of ["light", "dark"]) {
    for (const [name, viewport] of [
      ["desktop", DESKTOP],
      ["phone", PHONE],
    ]) {
      begin(`nobody is left out: ${name}, ${scheme}`);
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      await setViewport(viewport);
      await page.click("#plan");
      await waitForView("mode", "plan");
      await settle();
      assert.deepEqual(await browsing.graveFindings(page), [], "axe");
      await shoot(`${name}_${scheme}`);
      for (const language of ["de", "en"]) {
        await page.click("#language");
        await settle();
        const words = language === "de" ? /Norden/ : /North/;
        assert.match(await legend(), words);
        const boxes = await page.$$eval(".legend *, .bar *", (nodes) =>
          nodes.map((node) => node.getBoundingClientRect()).map((box) => [box.left, box.right]),
        );
        for (const [left, right] of boxes) {
          assert.ok(left >= 0 && right <= viewport.width, `from ${left} to ${right} px`);
        }
        if (language === "de" && name === "phone") await shoot(`german_${scheme}`);
      }
      await page.click("#plan");
      await waitForView("mode", "model");
    }
  }
}

try {
  await openPage();
  const models = await photosByModel();
  const [{ id }, { id: otherId }] = [models[0][0], models[0].at(-1)];
  await testButton(id);
  if (isKnown) for (const photos of models) await testNorthIsUp(photos);
  else await testUnknown();
  await testMouse(id, otherId);
  await testKeys(id);
  await testPhoto(id);
  await testTouch(id);
  await testLooks();
  begin("nothing was complained about");
  assert.deepEqual(await page.evaluate(() => window.violations), [], "the policy was violated");
  assert.deepEqual(complaints, [], "the browser complained");
  console.log("passed");
} catch (error) {
  console.error(`failed: ${step}\n${error.stack}`);
  if (complaints.length > 0) console.error(`the browser said:\n${complaints.join("\n")}`);
  await shoot("failed").catch(() => {});
  process.exitCode = 1;
} finally {
  await browser.close();
}
