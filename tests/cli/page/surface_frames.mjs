// SPDX-License-Identifier: Apache-2.0
// Measures how soon the page draws a surface, and how fluently, in a browser that has no graphics
// card: node surface_frames.mjs BASE_URL CHROMIUM [OUT_FOLDER]. tools/bench/tiles.py runs it.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { openBrowser, settle, viewData, waitForView } from "./browser.mjs";

const [base, chromium, outFolder] = process.argv.slice(2);
if (outFolder) mkdirSync(outFolder, { recursive: true });
const TURNS = 72;
const NEARER = 6;

const { browser, page, complaints } = await openBrowser(base, chromium);
page.setDefaultTimeout(300_000);

function tell(times) {
  times.sort((a, b) => a - b);
  const at = (share) => times[Math.floor(share * (times.length - 1))].toFixed(0);
  return `median ${at(0.5)} ms, 95th percentile ${at(0.95)} ms, most ${at(1)} ms`;
}

// Presses a key in each of so many frames, and gives the time from frame to frame.
function frames(key, count) {
  return page.evaluate(
    async (pressed, wanted) => {
      const view = document.querySelector("#view");
      const times = [];
      let last = await new Promise(requestAnimationFrame);
      for (let i = 0; i < wanted; ++i) {
        view.dispatchEvent(new KeyboardEvent("keydown", { key: pressed, bubbles: true }));
        const now = await new Promise(requestAnimationFrame);
        times.push(now - last);
        last = now;
      }
      return times;
    },
    key,
    count,
  );
}

const shoot = async (name) => {
  if (outFolder) await page.screenshot({ path: join(outFolder, `${name}.png`) });
};
const drawn = async () =>
  `${await viewData(page, "triangles")} triangles in ${await viewData(page, "tiles")} tiles, ` +
  `${await viewData(page, "drawn")} points`;

try {
  const start = Date.now();
  const seconds = () => ((Date.now() - start) / 1000).toFixed(1);
  await page.goto(base, { waitUntil: "load" });
  const first = await page.waitForFunction(
    () => {
      const count = Number(document.querySelector("#view")?.dataset.points);
      return count > 0 ? [count, (performance.now() / 1000).toFixed(1)] : null;
    },
    { polling: 20 },
  );
  const points = (await first.jsonValue()).join(" points after ") + " s";
  await page.waitForFunction(
    () => Number(document.querySelector("#view")?.dataset.triangles) > 0,
    { polling: 20 },
  );
  console.log(`  ${points}, some of the surface after ${seconds()} s`);
  await page.waitForFunction(
    (count) => Number(document.querySelector("#view").dataset.points) === count,
    { polling: 20 },
    await page.evaluate(async () => (await (await fetch("/v1/reconstructions")).json())[0].points),
  );
  console.log(`  all points after ${seconds()} s`);
  await waitForView(page, "surface", "complete");
  console.log(`  as fine as the view needs it after ${seconds()} s: ${await drawn()}`);
  await settle();
  await shoot("frames_whole");
  console.log(`  turned once around: ${tell(await frames("ArrowLeft", TURNS))}`);
  await settle();
  await waitForView(page, "surface", "complete");
  console.log(`  come near: ${tell(await frames("+", NEARER))}`);
  await settle();
  await waitForView(page, "surface", "complete");
  console.log(`  near: ${await drawn()}`);
  await shoot("frames_near");
  console.log(`  turned once around: ${tell(await frames("ArrowLeft", TURNS))}`);
  if (complaints.length > 0) throw new Error(complaints.join("\n"));
} finally {
  await browser.close();
}
