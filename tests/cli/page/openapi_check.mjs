// SPDX-License-Identifier: Apache-2.0
// Validates a description of an API by the schema of OpenAPI: node openapi_check.mjs FILE
// Prints what is wrong, and fails then.
import { Validator } from "@seriousme/openapi-schema-validator";
import { readFileSync } from "node:fs";

const validator = new Validator();
const result = await validator.validate(JSON.parse(readFileSync(process.argv[2], "utf8")));
for (const error of [result.errors ?? []].flat()) console.log(JSON.stringify(error));
console.log(`OpenAPI ${validator.version}: ${result.valid ? "valid" : "not valid"}`);
process.exitCode = result.valid ? 0 : 1;
