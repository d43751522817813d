// SPDX-License-Identifier: Apache-2.0
// Validates files of binary glTF by Khronos's gltf-validator: node contents_check.mjs FILE...
// Prints a line for each issue, hints as well, and fails where there is one.
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

let count = 0;
for (const path of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(path)), {
    uri: path,
    format: "glb",
    maxIssues: 20,
    writeTimestamp: false,
  });
  for (const issue of report.issues.messages) {
    console.log(`${path}: ${issue.code} ${issue.pointer}: ${issue.message}`);
  }
  count += report.issues.messages.length;
}
console.log(`${process.argv.length - 2} files, ${count} issues`);
process.exitCode = count > 0 ? 1 : 0;
