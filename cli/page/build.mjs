// SPDX-License-Identifier: Apache-2.0
// Bundles the page into dist/: page.js, page.css and index.html. The same sources give the same
// bytes. The licence of three.js, which page.js contains, stands at the end of page.js.
import { build } from "esbuild";
import { copyFile, mkdir, readFile, rm } from "node:fs/promises";
import { fileURLToPath } from "node:url";

process.chdir(fileURLToPath(new URL(".", import.meta.url)));
await rm("dist", { recursive: true, force: true });
await mkdir("dist");
const license = await readFile("node_modules/three/LICENSE", "utf8");
await build({
  entryPoints: { page: "src/main.ts" },
  outdir: "dist",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "none",
  footer: { js: `/*! three.js\n${license.trim()}\n*/` },
});
await build({ entryPoints: ["src/page.css"], outdir: "dist", minify: true, legalComments: "none" });
await copyFile("index.html", "dist/index.html");
