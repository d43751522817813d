// SPDX-License-Identifier: Apache-2.0
// Follows the journal by the server-sent events of /v1/events. It reads them with fetch, since
// EventSource cannot send a token. It connects again for ever, from the last event it has.
import type { JournalEntry } from "./answers";
import { Problem, type Api } from "./api";

// The daemon says that it is alive every 15 seconds (kAliveTime of cli/service/http_door.cc).
const SILENCE_MS_MAX = 40_000;
const PAUSE_MS_FIRST = 1_000;
const PAUSE_MS_MAX = 15_000;

export interface Listener {
  onEntry(entry: JournalEntry): void;
  onConnected(): void;
  // The connection ended, or was refused; it is tried again after the pause.
  onLost(error: unknown, pauseMs: number): void;
}

// Tells the entries after number `last`. Never returns.
export async function followJournal(api: Api, last: number, listener: Listener): Promise<never> {
  let pauseMs = PAUSE_MS_FIRST;
  for (;;) {
    const abort = new AbortController();
    let timer = 0;
    const heard = () => {
      clearTimeout(timer);
      timer = window.setTimeout(() => abort.abort(), SILENCE_MS_MAX);
    };
    let failure: unknown = null;
    try {
      heard();
      const headers = { "Last-Event-ID": String(last), Accept: "text/event-stream" };
      const response = await api.request("/v1/events", { headers, signal: abort.signal });
      if (!response.body) throw new Error("no body");
      listener.onConnected();
      pauseMs = PAUSE_MS_FIRST;
      for await (const event of eventsOf(response.body, heard)) {
        const entry = JSON.parse(event) as JournalEntry;
        last = Math.max(last, entry.sequence);
        listener.onEntry(entry);
      }
    } catch (error) {
      failure = error;
    }
    clearTimeout(timer);
    abort.abort();
    const asked = failure instanceof Problem ? failure.retryAfterSeconds : null;
    const pause = asked !== null ? asked * 1000 : pauseMs;
    listener.onLost(failure, pause);
    await new Promise((resolve) => setTimeout(resolve, pause));
    pauseMs = Math.min(2 * pauseMs, PAUSE_MS_MAX);
  }
}

// The data of each event, by the rules of the HTML standard, section 9.2.6, as far as the daemon
// makes use of them: fields end in \n, and an empty line ends an event.
export async function* eventsOf(
  body: ReadableStream<Uint8Array>,
  heard: () => void,
): AsyncGenerator<string> {
  const reader = body.getReader();
  const decoder = new TextDecoder();
  let rest = "";
  let data: string[] = [];
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    heard();
    const lines = (rest + decoder.decode(value, { stream: true })).split("\n");
    rest = lines.pop() ?? "";
    for (const line of lines) {
      if (line.startsWith("data:")) data.push(line.slice(5).trimStart());
      if (line !== "" || data.length === 0) continue;
      yield data.join("\n");
      data = [];
    }
  }
}
