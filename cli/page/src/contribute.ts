// SPDX-License-Identifier: Apache-2.0
// Sends photos to the city, two at a time, and asks what became of each.
import type { Outcome, PhotoDetails, Upload, Verdict } from "./answers";
import { ConnectionLost, Problem, whole, type Api } from "./api";

export type Stage =
  | "line" // waits on this page
  | "sending"
  | "later" // the daemon asked to come again later
  | "lost" // the connection was lost; it is sent again
  | "waiting" // it is on the daemon's disk and waits for its turn
  | "broken" // it could not be sent
  | "judged" // `verdict` and `words` tell what became of it
  | "refused" // `words` tell why
  | "unknown"; // its turn has come, and the daemon has forgotten it

export interface Job {
  file: File;
  contributor: string; // "": the daemon chooses
  camera: string; // "": it is found by the photo
  stage: Stage;
  verdict: Verdict | null;
  words: string; // the daemon's
  photo: number | null; // its number in the city
  upload: Upload | null;
}

const SENDERS = 2;
const POLLED_MAX = 8; // uploads that are asked for at once; their turns come in their order
const POLL_MS = 1_500;
const PAUSE_MS = 5_000; // where the daemon names no Retry-After
const PAUSE_MS_MAX = 30_000;
// The daemon has no room just now, or a proxy before it finds it away.
const LATER = new Set([429, 502, 503, 504]);
// A connection that ends so often while a body is sent, though the daemon is alive, will not hold;
// or the file cannot be read, which a browser tells in the same way.
const LOST_COUNT_MAX = 5;

export class Sender {
  readonly jobs: Job[] = [];
  private active = 0;
  private isPolling = false;

  // `onChange` is told of each step of a job.
  constructor(
    private readonly api: Api,
    private readonly onChange: (job: Job) => void,
  ) {}

  add(files: Iterable<File>, contributor: string, camera: string): void {
    for (const file of files) {
      const job: Job = {
        file,
        contributor,
        camera,
        stage: "line",
        verdict: null,
        words: "",
        photo: null,
        upload: null,
      };
      this.jobs.push(job);
      this.onChange(job);
    }
    this.sendNext();
  }

  get doneCount(): number {
    return this.jobs.filter((job) => isOver(job)).length;
  }

  // Whether there are photos that the daemon does not have yet.
  get hasUnsent(): boolean {
    return this.jobs.some((job) => !isOver(job) && job.stage !== "waiting");
  }

  private sendNext(): void {
    while (this.active < SENDERS) {
      const job = this.jobs.find((one) => one.stage === "line");
      if (!job) return;
      ++this.active;
      this.set(job, { stage: "sending" });
      void this.send(job).finally(() => {
        --this.active;
        this.sendNext();
      });
    }
  }

  private async send(job: Job): Promise<void> {
    const query = new URLSearchParams({ name: job.file.name });
    if (job.contributor) query.set("contributor", job.contributor);
    if (job.camera) query.set("camera", job.camera);
    const isImage = job.file.type.startsWith("image/");
    const headers = {
      "Content-Type": isImage ? job.file.type : "application/octet-stream",
      Prefer: "respond-async",
    };
    // The daemon reads + as it stands: a space is %20.
    const path = `/v1/photos?${query.toString().replaceAll("+", "%20")}`;
    for (let lost = 0, pauseMs = 1_000; ; ) {
      this.set(job, { stage: "sending" });
      try {
        const response = await this.api.request(path, { method: "POST", headers, body: job.file });
        const body = (await whole(() => response.json())) as Upload | Outcome;
        if ("upload" in body) this.wait(job, body);
        else this.judge(job, body);
        return;
      } catch (error) {
        if (error instanceof Problem) {
          if (!LATER.has(error.status)) return this.refuse(job, error);
          this.set(job, { stage: "later", words: error.message });
          const seconds = error.retryAfterSeconds;
          await sleep(seconds === null ? PAUSE_MS : 1000 * seconds);
        } else if (error instanceof ConnectionLost) {
          if (await this.isAlive()) ++lost;
          if (lost >= LOST_COUNT_MAX) return this.set(job, { stage: "broken", words: "" });
          this.set(job, { stage: "lost", words: "" });
          await sleep(pauseMs);
          pauseMs = Math.min(2 * pauseMs, PAUSE_MS_MAX);
        } else {
          return this.set(job, { stage: "broken", words: String(error) });
        }
      }
    }
  }

  private async isAlive(): Promise<boolean> {
    try {
      await this.api.request("/healthz");
      return true;
    } catch (error) {
      return error instanceof Problem;
    }
  }

  private refuse(job: Job, problem: Problem): void {
    if (problem.status === 409) {
      this.set(job, { stage: "judged", verdict: "duplicate", words: problem.message });
    } else {
      this.set(job, { stage: "refused", words: problem.message });
    }
  }

  private wait(job: Job, upload: Upload): void {
    this.set(job, { stage: "waiting", words: upload.why_not ?? "", upload });
    if (!this.isPolling) void this.poll();
  }

  private judge(job: Job, outcome: Outcome): void {
    this.set(job, {
      stage: "judged",
      verdict: outcome.verdict,
      words: outcome.reason,
      photo: outcome.id,
    });
  }

  private async poll(): Promise<void> {
    this.isPolling = true;
    for (;;) {
      await sleep(POLL_MS);
      const waiting = this.jobs.filter((job) => job.stage === "waiting");
      if (waiting.length === 0) break;
      waiting.sort((a, b) => (a.upload?.upload ?? 0) - (b.upload?.upload ?? 0));
      await Promise.all(waiting.slice(0, POLLED_MAX).map((job) => this.ask(job)));
    }
    this.isPolling = false;
  }

  private async ask(job: Job): Promise<void> {
    try {
      const upload = await this.api.json<Upload>(`/v1/uploads/${job.upload?.upload}`);
      if (upload.outcome) this.judge(job, upload.outcome);
      else if (upload.state === "waiting") this.set(job, { words: upload.why_not ?? "" });
      else this.set(job, { stage: "refused", words: upload.why_not ?? "" });
    } catch (error) {
      // Nothing is known of a lost connection: it is asked again.
      if (error instanceof Problem && error.status === 404) await this.findPhoto(job);
      else if (error instanceof Problem && error.status < 500 && error.status !== 429) {
        this.set(job, { stage: "unknown", words: error.message });
      }
    }
  }

  // A daemon that began anew does not remember an upload, but the city has the photo.
  private async findPhoto(job: Job): Promise<void> {
    const name = `${job.upload?.contributor}/${job.upload?.image}`;
    try {
      const photo = await this.api.json<PhotoDetails>(`/v1/photos/${encodeURIComponent(name)}`);
      this.judge(job, photo);
    } catch (error) {
      if (error instanceof Problem && error.status < 500) this.set(job, { stage: "unknown" });
    }
  }

  private set(job: Job, change: Partial<Job>): void {
    Object.assign(job, change);
    this.onChange(job);
  }
}

export function isOver(job: Job): boolean {
  return ["broken", "judged", "refused", "unknown"].includes(job.stage);
}

function sleep(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
