// SPDX-License-Identifier: Apache-2.0
// Writes a C++ file that holds the page's files: node embed.mjs FOLDER OUT.cc
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const FILES = [
  ["index.html", "text/html; charset=utf-8"],
  ["page.css", "text/css; charset=utf-8"],
  ["page.js", "text/javascript; charset=utf-8"],
];
// Bytes in a line of the file, for people who open it.
const PIECE = 8000;

// Bytes as literals: of three octal digits where they are not plain, so that no digit that follows
// is taken for one of theirs.
function literals(bytes) {
  const lines = [];
  for (let begin = 0; begin < bytes.length; begin += PIECE) {
    let line = "";
    for (const byte of bytes.subarray(begin, begin + PIECE)) {
      const isPlain = byte >= 32 && byte < 127 && byte !== 34 && byte !== 92 && byte !== 63;
      line += isPlain ? String.fromCharCode(byte) : "\\" + byte.toString(8).padStart(3, "0");
    }
    lines.push(`"${line}"`);
  }
  return lines.join("\n") || '""';
}

const [folder, out] = process.argv.slice(2);
const entries = FILES.map(([name, type]) => {
  const bytes = readFileSync(join(folder, name));
  const tag = createHash("sha256").update(bytes).digest("hex").slice(0, 32);
  const view = `std::string_view(\n${literals(bytes)}, ${bytes.length})`;
  return `    {"${name}", "${type}", "\\"${tag}\\"", ${view}},\n`;
});
writeFileSync(out, `// Made by cli/page/embed.mjs; do not edit.
#include "cli/page/page_files.h"

namespace veduta {

std::span<const PageFile> PageFiles() {
  static constexpr PageFile kFiles[] = {
${entries.join("")}  };
  return kFiles;
}

}  // namespace veduta
`);
