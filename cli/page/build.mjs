// SPDX-License-Identifier: Apache-2.0
// Bundles the page into dist/: page.js, page.css and index.html. The same sources give the same
// bytes. The licences of what page.js contains of others stand at its end.
import { build } from "esbuild";
import { copyFile, mkdir, readFile, rm } from "node:fs/promises";
import { fileURLToPath } from "node:url";

process.chdir(fileURLToPath(new URL(".", import.meta.url)));
await rm("dist", { recursive: true, force: true });
await mkdir("dist");
const notices = ["three", "3d-tiles-renderer"].map(async (name) => {
  const license = await readFile(`node_modules/${name}/LICENSE`, "utf8");
  return `/*! ${name}\n${license.trim()}\n*/`;
});
await build({
  entryPoints: { page: "src/main.ts" },
  outdir: "dist",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "none",
  footer: { js: (await Promise.all(notices)).join("\n") },
});
await build({ entryPoints: ["src/page.css"], outdir: "dist", minify: true, legalComments: "none" });
await copyFile("index.html", "dist/index.html");
