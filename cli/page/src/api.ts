// SPDX-License-Identifier: Apache-2.0
// Asks the daemon: adds the token, reads problems (RFC 9457), and keeps answers with their ETag.
import { forgetValue, keepValue, keptValue } from "./kept";

// The daemon's answer when it refuses. `message` is its own words.
export class Problem extends Error {
  constructor(
    readonly status: number,
    detail: string,
    readonly retryAfterSeconds: number | null,
  ) {
    super(detail);
  }
}

// No answer came at all.
export class ConnectionLost extends Error {}

const TOKEN_KEY = "veduta.token";

// Answers are kept below this length, and so many of them.
const KEPT_LENGTH_MAX = 4_000_000;
const KEPT_COUNT_MAX = 300;

export class Api {
  private readonly kept = new Map<string, { tag: string; value: unknown }>();
  private asking: Promise<string | null> | null = null;
  private isDeclined = false; // the person has no token: 401 does not ask again

  // `askToken` shows a form and gives the token, or null where the person has none. `detail` is
  // what the daemon says, or "".
  constructor(private readonly askToken: (detail: string) => Promise<string | null>) {}

  get token(): string | null {
    return keptValue("sessionStorage", TOKEN_KEY);
  }

  set token(value: string | null) {
    if (value === null) forgetValue("sessionStorage", TOKEN_KEY);
    else keepValue("sessionStorage", TOKEN_KEY, value);
    this.kept.clear();
  }

  // Resolves with an answer below 400. Throws Problem or ConnectionLost; an AbortError passes
  // through. A 401 asks for a token and then tries again.
  async request(path: string, init: RequestInit = {}): Promise<Response> {
    for (;;) {
      const token = this.token;
      const headers = new Headers(init.headers);
      if (token !== null) headers.set("Authorization", `Bearer ${token}`);
      let response: Response;
      try {
        response = await fetch(path, { cache: "no-store", ...init, headers });
      } catch (error) {
        if (error instanceof DOMException && error.name === "AbortError") throw error;
        throw new ConnectionLost(String(error));
      }
      if (response.ok || response.status === 304) return response;
      const problem = await problemOf(response);
      if (response.status !== 401) throw problem;
      // Another request may have brought a token meanwhile.
      if (this.token !== token) continue;
      const detail = token === null ? "" : problem.message;
      if (this.isDeclined || (await this.askOnce(detail)) === null) throw problem;
    }
  }

  // Asks for a token, once for all requests that wait for it. Null: nobody gave one.
  askOnce(detail = ""): Promise<string | null> {
    this.asking ??= this.askToken(detail)
      .then((token) => {
        this.isDeclined = token === null;
        if (token !== null) this.token = token;
        return token;
      })
      .finally(() => (this.asking = null));
    return this.asking;
  }

  async json<T>(path: string): Promise<T> {
    const response = await this.request(path);
    return (await whole(() => response.json())) as T;
  }

  // Posts an object as JSON.
  async send<T>(path: string, value: unknown): Promise<T> {
    const headers = { "Content-Type": "application/json" };
    const response = await this.request(path, {
      method: "POST",
      headers,
      body: JSON.stringify(value),
    });
    return (await whole(() => response.json())) as T;
  }

  async blob(path: string): Promise<Blob> {
    const response = await this.request(path);
    return whole(() => response.blob());
  }

  // Like json, but asks with If-None-Match. The same object comes back while nothing has changed.
  async jsonIfChanged<T>(path: string): Promise<T> {
    const kept = this.kept.get(path);
    const response = await this.request(
      path,
      kept ? { headers: { "If-None-Match": kept.tag } } : {},
    );
    // The body is read in any case: a browser calls a request that nobody reads aborted.
    const text = await whole(() => response.text());
    if (response.status === 304 && kept) return kept.value as T;
    const value = JSON.parse(text) as T;
    const tag = response.headers.get("ETag");
    if (tag && text.length < KEPT_LENGTH_MAX) this.keep(path, tag, value);
    return value;
  }

  // Forgets what was kept first: a person may look at thousands of photos.
  private keep(path: string, tag: string, value: unknown): void {
    this.kept.delete(path);
    const [oldest] = this.kept.keys();
    if (this.kept.size >= KEPT_COUNT_MAX && oldest !== undefined) this.kept.delete(oldest);
    this.kept.set(path, { tag, value });
  }
}

// Reads the body of an answer. One that breaks off is a lost connection, too.
export async function whole<T>(read: () => Promise<T>): Promise<T> {
  try {
    return await read();
  } catch (error) {
    throw new ConnectionLost(String(error));
  }
}

async function problemOf(response: Response): Promise<Problem> {
  let detail = `${response.status} ${response.statusText}`;
  try {
    const body = (await response.json()) as { detail?: unknown };
    if (typeof body.detail === "string") detail = body.detail;
  } catch {
    // A proxy may answer something that is no JSON: the code alone is told then.
  }
  const retry = Number(response.headers.get("Retry-After") ?? "");
  return new Problem(response.status, detail, retry > 0 ? retry : null);
}
