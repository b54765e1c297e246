// SPDX-License-Identifier: Apache-2.0
// What goes over the wire: protobuf's JSON with its defaults filled in, calls, streams of jobs, and the WebSocket's messages.
import {type Calls, fields, type Job, responses, type Streams, type VolumeLayer_Kind} from './api.gen';

/** Why a call failed: the daemon's code ("FAILED_PRECONDITION", ...) and its sentence. */
export class ApiError extends Error {
  constructor(readonly status: number, readonly code: string, message: string, readonly order = '') {
    super(message);
  }
}

/** Told of each order that was carried out. */
export const answered = new Set<(order: string) => void>();

/** Names an order: its method, and the session that it is about. */
function orderOf(method: string, request: unknown): string {
  const {session} = request as {session?: string};
  return session ? `${method} ${session}` : method;
}

function tellAnswered(method: string, request: unknown): void {
  for (const tell of answered) tell(orderOf(method, request));
}

/** Reads a message of this type: what protobuf leaves out gets its default, 64-bit numbers and "NaN" become numbers. */
export function decode(type: string, json: unknown): unknown {
  const table = fields[type];
  if (!table) throw new Error(`unknown message ${type}`);
  const source = (json ?? {}) as Record<string, unknown>;
  const message: Record<string, unknown> = {};
  for (const [name, [of, kind, label]] of Object.entries(table)) {
    const value = source[name];
    if (label === 'many') message[name] = ((value ?? []) as unknown[]).map(item => one(of, kind, item));
    else if (value !== undefined && value !== null) message[name] = one(of, kind, value);
    else if (label === 'one') message[name] = of === 'enum' ? kind : {number: 0, boolean: false, string: ''}[kind];
  }
  return message;
}

function one(of: string, kind: string, value: unknown): unknown {
  if (of === 'message') return decode(kind, value);
  return of === 'scalar' && kind === 'number' ? Number(value) : value;
}

async function post(path: string, request: unknown, signal?: AbortSignal): Promise<Response> {
  const response = await fetch(`/api/v1/${path}`, {
    method: 'POST',
    headers: {'Content-Type': 'application/json'},
    body: JSON.stringify(request),
    signal,
  });
  if (response.ok) return response;
  const error = (await response.json().catch(() => ({}))) as {code?: string; message?: string};
  throw new ApiError(response.status, error.code ?? '', error.message ?? `${path}: answered ${response.status} ${response.statusText}`, orderOf(path, request));
}

export async function call<M extends keyof Calls>(method: M, request: Calls[M][0] = {}, signal?: AbortSignal): Promise<Calls[M][1]> {
  const response = await post(method, request, signal);
  const answer = decode(responses[method], await response.json()) as Calls[M][1];
  tellAnswered(method, request);
  return answer;
}

/** Methods that tell how far they are, and what came of them. */
export type Jobs = {[M in keyof Streams as Streams[M][1] extends Job ? M : never]: Streams[M]};

/** Of a job: tells each state, and returns the last, which is DONE. An error's line and a stream that ends before it is done are
 *  thrown. */
export async function follow<M extends keyof Jobs>(method: M, request: Jobs[M][0], tell: (message: Job) => void): Promise<Job> {
  const reader = (await post(method, request)).body!.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  let last: Job | undefined;
  for (;;) {
    const {done, value} = await reader.read().catch(() => ({done: true, value: ''}));
    const lines = (rest + (value ?? '')).split('\n');
    rest = lines.pop()!;  // a line that is cut short is none
    for (const line of lines.filter(text => text.trim() !== '')) {
      const json = JSON.parse(line) as {code?: string; message?: string};
      if (json.code !== undefined && json.message !== undefined) throw new ApiError(500, json.code, json.message, orderOf(method, request));
      tell((last = decode(responses[method], json) as Job));
    }
    if (!done) continue;
    if (last?.state === 'DONE') {
      tellAnswered(method, request);
      return last;
    }
    throw new ApiError(502, '', 'The connection broke off before it was done. See what the journal says, and ask again.', orderOf(method, request));
  }
}

/** The header of a binary message, and the bytes behind it. */
export interface Picture {
  kind: 'picture';
  camera_id: string;
  frame_id: number;
  monotonic_ns: number;
  width: number;
  height: number;
}
export interface View {
  kind: 'captured' | 'rendered';
  iteration: number;
  camera_id: string;
}
/** A quantity on a volume's voxels: 1..255 from low to high, 0 where it isn't told. */
export interface Layer {
  kind: VolumeLayer_Kind;
  low: number;
  high: number;
  quick: boolean;
}
/** Its bytes are the voxels of its brightness, and behind them those of each layer. */
export interface Volume {
  kind: 'volume';
  nx: number;
  ny: number;
  nz: number;
  box?: {center?: number[]; size?: number[]};
  brightest: number;
  layers?: Layer[];
}
export type BinaryHeader = Picture | View | Volume;

/** u32 little-endian length, so much JSON, then the bytes. 64-bit numbers may come as strings. */
export function unpack(message: ArrayBuffer): [BinaryHeader, Uint8Array] {
  if (message.byteLength < 4) throw new Error('a binary message without its header');
  const length = new DataView(message).getUint32(0, true);
  if (4 + length > message.byteLength) throw new Error('a binary message shorter than its header says');
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length))) as BinaryHeader;
  if (header.kind === 'picture') {
    header.frame_id = Number(header.frame_id);
    header.monotonic_ns = Number(header.monotonic_ns);
  }
  return [header, new Uint8Array(message, 4 + length)];
}
