// SPDX-License-Identifier: Apache-2.0
// Bundles the page into dist/: page.js, page.css and index.html. The same sources give the same
// bytes. The licences of the packages that page.js contains stand at its end.
import { build } from "esbuild";
import { appendFile, copyFile, mkdir, readdir, readFile, rm } from "node:fs/promises";
import { fileURLToPath } from "node:url";

process.chdir(fileURLToPath(new URL(".", import.meta.url)));
await rm("dist", { recursive: true, force: true });
await mkdir("dist");
const bundle = await build({
  entryPoints: { page: "src/main.ts" },
  outdir: "dist",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "none",
  metafile: true,
});
const names = Object.keys(bundle.metafile.inputs).map(
  (path) => /^node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1],
);
for (const name of [...new Set(names)].filter((one) => one !== undefined).sort()) {
  const folder = `node_modules/${name}`;
  const file = (await readdir(folder)).find((one) => /^licen[cs]e/i.test(one));
  if (file === undefined) throw new Error(`${name} has no file with its licence`);
  const license = (await readFile(`${folder}/${file}`, "utf8")).trim();
  await appendFile("dist/page.js", `/*! ${name}\n${license.replaceAll("*/", "* /")}\n*/\n`);
}
await build({ entryPoints: ["src/page.css"], outdir: "dist", minify: true, legalComments: "none" });
await copyFile("index.html", "dist/index.html");
