// SPDX-License-Identifier: Apache-2.0
// Values that the browser keeps for the page. Where it may not keep any, they last as long as the
// page does: each use of its storage throws then.

type Area = "localStorage" | "sessionStorage"; // for ever; until the tab is closed

const forgotten = new Map<string, string>();

export function keptValue(area: Area, key: string): string | null {
  try {
    return window[area].getItem(key);
  } catch {
    return forgotten.get(key) ?? null;
  }
}

export function keepValue(area: Area, key: string, value: string): void {
  try {
    window[area].setItem(key, value);
  } catch {
    forgotten.set(key, value);
  }
}

export function forgetValue(area: Area, key: string): void {
  forgotten.delete(key);
  try {
    window[area].removeItem(key);
  } catch {
    // The browser keeps nothing.
  }
}
