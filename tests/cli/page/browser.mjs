// SPDX-License-Identifier: Apache-2.0
// A browser for tests of the page: Chromium without a graphics card, at a page that notes down
// whatever the browser complains about.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import puppeteer from "puppeteer-core";

export const WAIT_MS = 60_000;
export const DESKTOP = { width: 1280, height: 800 };

const require = createRequire(import.meta.url);
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

export const settle = (ms = 400) => new Promise((done) => setTimeout(done, ms));

// The page asks `base` alone: a request to any other host is a complaint.
export async function openBrowser(base, chromium) {
  const browser = await puppeteer.launch({
    executablePath: chromium,
    args: [
      "--no-sandbox",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      "--lang=en-US",
      "--disable-dev-shm-usage",
    ],
    protocolTimeout: 10 * WAIT_MS, // a frame of a large city may take seconds
    defaultViewport: DESKTOP,
  });
  const complaints = [];
  const page = await browser.newPage();
  page.setDefaultTimeout(WAIT_MS);
  page.on("console", (message) => {
    const isComplaint = message.type() === "error" || message.type() === "warn";
    // SwiftShader says that reading pixels for a screenshot stalls: that is no fault of the page.
    if (isComplaint && !message.text().includes("GPU stall")) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(`error: ${error.message}`));
  page.on("requestfailed", (request) => {
    complaints.push(`request failed: ${request.url()} ${request.failure()?.errorText}`);
  });
  page.on("response", (response) => {
    if (response.status() >= 400) complaints.push(`${response.status()} ${response.url()}`);
  });
  page.on("request", (request) => {
    const url = new URL(request.url());
    const isOwn = url.origin === new URL(base).origin || ["data:", "blob:"].includes(url.protocol);
    if (!isOwn) complaints.push(`a request to another host: ${request.url()}`);
  });
  await page.evaluateOnNewDocument(() => {
    window.violations = [];
    document.addEventListener("securitypolicyviolation", (event) => {
      window.violations.push(`${event.violatedDirective} ${event.blockedURI}`);
    });
  });
  return { browser, page, complaints };
}

// What the view says of itself: a key of its dataset.
export const viewData = (page, name) =>
  page.$eval("#view", (node, key) => node.dataset[key] ?? "", name);

export const waitForView = (page, name, value) =>
  page.waitForFunction(
    (key, wanted) => document.querySelector("#view")?.dataset[key] === wanted,
    {},
    name,
    value,
  );

// What axe-core finds serious or critical, as texts.
export async function graveFindings(page) {
  await page.evaluate(axe);
  const results = await page.evaluate(() =>
    window.axe.run(document, { resultTypes: ["violations"] }),
  );
  const grave = results.violations.filter((one) => ["serious", "critical"].includes(one.impact));
  return grave.map((one) => `${one.id}: ${one.nodes.map((n) => n.html).join(" | ")}`);
}

// How many colours the left half of the view shows: one where nothing is drawn.
export async function colorsInView(page) {
  const shot = await page.screenshot({ encoding: "base64" });
  return page.evaluate(async (png) => {
    // The policy of the page forbids fetch of data:, so the bytes are decoded here.
    const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const width = Math.floor(bitmap.width / 2);
    const { data } = context.getImageData(0, 0, width, bitmap.height - 120);
    const colors = new Set();
    for (let i = 0; i < data.length; i += 4) {
      colors.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    }
    return colors.size;
  }, shot);
}
