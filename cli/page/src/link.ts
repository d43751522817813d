// SPDX-License-Identifier: Apache-2.0
// Links for reading carry their token behind "#", which a browser sends to nobody.

// Takes the token out of the address, which then shows it no longer and stays in no history; null
// where there is none.
export function takeLink(): string | null {
  const token = /^#link=([!-~]+)$/.exec(location.hash)?.[1] ?? null;
  if (token !== null) window.history.replaceState(null, "", location.pathname + location.search);
  return token;
}
