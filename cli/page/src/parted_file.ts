// SPDX-License-Identifier: Apache-2.0
// Sends a file in parts by the tus protocol: a lost connection costs what had not come yet.
import { DetailedError, Upload as TusUpload } from "tus-js-client";
import { ConnectionLost, Problem, type Api } from "./api";

// A part of a file is asked for again where its answer got lost.
const PART_BYTES = 4 << 20;

// What the daemon knows of a file that has arrived.
export interface ArrivedFile {
  upload: number; // its number in line
  image: string;
  contributor: string;
}

export class PartedFile {
  arrivedBytes = 0; // that the daemon has told to be on its disk
  private url: string | null = null;

  constructor(
    private readonly api: Api,
    private readonly file: File,
  ) {}

  // Resolves once all of the file is on the daemon's disk. Throws Problem or ConnectionLost; called
  // again it goes on from where it was. A 401 asks for a token and then goes on.
  async send(metadata: Record<string, string>): Promise<ArrivedFile> {
    for (;;) {
      try {
        return await this.api.json<ArrivedFile>(await this.sendRest(metadata));
      } catch (error) {
        const isAsked = error instanceof Problem && error.status === 401;
        if (!isAsked || (await this.api.askOnce(error.message)) === null) throw error;
      }
    }
  }

  // Resolves with the upload's address.
  private sendRest(metadata: Record<string, string>): Promise<string> {
    return new Promise((resolve, reject) => {
      const token = this.api.token;
      const upload = new TusUpload(this.file, {
        endpoint: "/v1/tus",
        uploadUrl: this.url,
        chunkSize: PART_BYTES,
        headers: token === null ? {} : { Authorization: `Bearer ${token}` },
        metadata,
        retryDelays: null, // whoever calls tries again
        storeFingerprintForResuming: false,
        onUploadUrlAvailable: () => (this.url = upload.url),
        onAfterResponse: (_request, response) => {
          const told = Number(response.getHeader("Upload-Offset") ?? "");
          if (told > this.arrivedBytes) this.arrivedBytes = told;
        },
        onSuccess: () => resolve(new URL(upload.url ?? "", location.href).pathname),
        onError: (error) => reject(failureOf(error)),
      });
      upload.start();
    });
  }
}

function failureOf(error: Error | DetailedError): Error {
  const response = error instanceof DetailedError ? error.originalResponse : null;
  const status = response?.getStatus() ?? 0;
  if (!response || status === 0) return new ConnectionLost(String(error));
  let detail = `${status}`;
  try {
    const body = JSON.parse(response.getBody()) as { detail?: unknown };
    if (typeof body.detail === "string") detail = body.detail;
  } catch {
    // An answer to HEAD has no body, and a proxy may answer something that is no JSON.
  }
  const retry = Number(response.getHeader("Retry-After") ?? "");
  return new Problem(status, detail, retry > 0 ? retry : null);
}
