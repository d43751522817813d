// SPDX-License-Identifier: Apache-2.0
// Checks answers against the types of STAC 1.0.0 that the package stac-ts has made of its schemas:
// node stac_check.mjs FILE... Prints what is wrong, and fails then. The schemas themselves are in no
// package of npm.
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import ts from "typescript";

const TYPES = { Feature: "StacItem", Collection: "StacCollection", Catalog: "StacCatalog" };

// Beside this file, where the package is found.
const name = fileURLToPath(new URL("stac_answers.ts", import.meta.url));
let text = 'import type { StacCatalog, StacCollection, StacItem } from "stac-ts";\n';
const paths = process.argv.slice(2);
for (const [i, path] of paths.entries()) {
  const answer = readFileSync(path, "utf8").trim();
  text += `export const answer${i}: ${TYPES[JSON.parse(answer).type] ?? "never"} = ${answer};\n`;
}

const options = {
  strict: true,
  noEmit: true,
  types: [],
  target: ts.ScriptTarget.ES2022,
  module: ts.ModuleKind.ESNext,
  moduleResolution: ts.ModuleResolutionKind.Bundler,
};
const host = ts.createCompilerHost(options);
const { fileExists, getSourceFile, readFile } = host;
host.fileExists = (path) => path === name || fileExists.call(host, path);
host.readFile = (path) => (path === name ? text : readFile.call(host, path));
host.getSourceFile = (path, ...more) =>
  path === name
    ? ts.createSourceFile(path, text, options.target)
    : getSourceFile.call(host, path, ...more);
const findings = ts.getPreEmitDiagnostics(ts.createProgram([name], options, host));
for (const finding of findings) {
  const line = finding.file ? finding.file.getLineAndCharacterOfPosition(finding.start).line : 0;
  const path = paths[line - 1] ?? "";
  console.log(`${path}: ${ts.flattenDiagnosticMessageText(finding.messageText, "\n")}`);
}
console.log(`${paths.length} files, ${findings.length} issues`);
process.exitCode = findings.length > 0 ? 1 : 0;
