// SPDX-License-Identifier: Apache-2.0
// A daemon that only talks: the console's wire on a port of its own, what it shows and answers is the test's to say.
import {readFile} from 'node:fs/promises';
import {createServer, type IncomingMessage, type Server, type ServerResponse} from 'node:http';
import type {AddressInfo} from 'node:net';
import {extname, join, normalize} from 'node:path';

import {WebSocket, WebSocketServer} from 'ws';

import type {Calls, DaemonStatus, Light} from '../../../daemon/console/src/api.gen';

const kTypes: Record<string, string> = {'.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml'};
const kPolicy = "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; frame-ancestors 'none'";

/** What the daemon answers instead: a status of HTTP, gRPC's code and a sentence. */
export class Refusal extends Error {
  constructor(readonly status: number, readonly code: string, message: string) {
    super(message);
  }
}

/** As protobuf's JSON has it: what is its default may be left out. */
type Told<T> = T extends (infer Item)[] ? Told<Item>[] : T extends object ? {[K in keyof T]?: Told<T[K]>} : T;
type Answers = {[M in keyof Calls]?: (request: Calls[M][0]) => Told<Calls[M][1]> | Promise<Told<Calls[M][1]>>};
type Jobs = Partial<Record<string, (request: Record<string, unknown>) => AsyncIterable<object>>>;

interface Watcher {
  socket: WebSocket;
  wanted: {camera_ids: string[]; rate_hz: number} | null;
  due: number;
}

export class Mock {
  status: Partial<DaemonStatus> = {phase: 'IDLE', light: 'GREEN', cameras: []};
  answers: Answers = {};
  jobs: Jobs = {};
  token?: string;
  /** The secret of a link that opens the console, once. */
  link?: string;
  /** A camera's picture now. */
  jpeg?: (camera: string, frame: number) => Uint8Array | undefined;
  /** Every call, in order. */
  readonly calls: {method: string; request: Record<string, unknown>}[] = [];
  private readonly watchers = new Set<Watcher>();
  private readonly notices: object[] = [];
  private server?: Server;
  private sockets?: WebSocketServer;
  private timer?: NodeJS.Timeout;
  private frame = 0;
  private revision = 0;
  port = 0;

  constructor(private readonly console: string) {}

  get url(): string {
    return `http://127.0.0.1:${this.port}/`;
  }

  async start(): Promise<void> {
    this.server = createServer((request, response) => void this.handle(request, response));
    this.sockets = new WebSocketServer({noServer: true});
    this.server.on('upgrade', (request, socket, head) => {
      if (!this.allowed(request)) {
        socket.end('HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\nConnection: close\r\n\r\n');
        return;
      }
      this.sockets!.handleUpgrade(request, socket, head, ws => this.welcome(ws));
    });
    await new Promise<void>(resolve => this.server!.listen(this.port, '127.0.0.1', resolve));
    this.port = (this.server.address() as AddressInfo).port;
    this.timer = setInterval(() => this.sendPictures(), 10);
  }

  /** As when the daemon dies. The port stays its own for the next start. */
  async stop(): Promise<void> {
    clearInterval(this.timer);
    for (const {socket} of this.watchers) socket.terminate();
    this.watchers.clear();
    this.server!.closeAllConnections();
    await new Promise<void>(resolve => this.server!.close(() => resolve()));
  }

  /** Says nothing more, and closes nothing. */
  silent = false;

  show(change: Partial<DaemonStatus> = {}): void {
    Object.assign(this.status, change, {revision: String(++this.revision), now_ns: String(process.hrtime.bigint()), now_utc: new Date().toISOString()});
    for (const message of this.told()) this.tell(message);
  }

  notice(light: Light, text: string): void {
    const notice = {id: String(this.notices.length + 1), light, utc: new Date().toISOString(), text};
    this.notices.push(notice);
    this.tell({notice});
  }

  tell(message: object): void {
    for (const {socket} of this.watchers) if (!this.silent) socket.send(JSON.stringify(message));
  }

  tellBytes(header: object, bytes: Uint8Array): void {
    for (const {socket} of this.watchers) if (!this.silent) socket.send(pack(header, bytes));
  }

  get wanted(): Watcher['wanted'][] {
    return [...this.watchers].map(watcher => watcher.wanted);
  }

  /** The rounds come by themselves, and a status without them. */
  private told(): object[] {
    const {alignment} = this.status;
    const status = {...this.status, now_ns: String(process.hrtime.bigint()), ...(alignment && {alignment: {...alignment, history: []}})};
    return [{rounds: {history: alignment?.history ?? []}}, {status}];
  }

  private welcome(socket: WebSocket): void {
    const watcher: Watcher = {socket, wanted: null, due: 0};
    this.watchers.add(watcher);
    socket.on('close', () => this.watchers.delete(watcher));
    socket.on('message', data => { watcher.wanted = (JSON.parse(String(data)) as {watch: Watcher['wanted']}).watch; });
    for (const message of this.told()) socket.send(JSON.stringify(message));
    for (const notice of this.notices) socket.send(JSON.stringify({notice}));
  }

  // One-slot mailboxes: who hasn't read the last pictures gets none.
  private sendPictures(): void {
    const now = performance.now();
    for (const watcher of this.watchers) {
      if (!watcher.wanted || !this.jpeg || this.silent || now < watcher.due || watcher.socket.bufferedAmount > 0) continue;
      watcher.due = Math.max(watcher.due + 1000 / watcher.wanted.rate_hz, now);
      const frame = ++this.frame;
      for (const camera of this.status.cameras ?? []) {
        if (watcher.wanted.camera_ids.length > 0 && !watcher.wanted.camera_ids.includes(camera.id)) continue;
        const jpeg = camera.state === 'FILMING' ? this.jpeg(camera.id, frame) : undefined;
        if (jpeg) watcher.socket.send(pack({kind: 'picture', camera_id: camera.id, frame_id: String(frame), monotonic_ns: String(process.hrtime.bigint()), width: 640, height: 480}, jpeg));
      }
    }
  }

  private allowed(request: IncomingMessage): boolean {
    return !this.token || (request.headers.cookie ?? '').includes(`emberlock=${this.token}`);
  }

  private async handle(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const url = new URL(request.url!, this.url);
    response.setHeader('Content-Security-Policy', kPolicy);
    if (url.pathname === '/open') return this.open(url, request, response);
    if (url.pathname.startsWith('/api/v1/')) return this.api(url.pathname.slice(8), request, response);
    if (!this.allowed(request)) {
      response.writeHead(401, {'Content-Type': 'text/html; charset=utf-8'}).end('<!doctype html><p>Type <code>emberlock console</code></p>');
      return;
    }
    const path = normalize(url.pathname === '/' ? 'index.html' : url.pathname.slice(1));
    try {
      const file = await readFile(join(this.console, path));
      response.writeHead(200, {'Content-Type': kTypes[extname(path)] ?? 'application/octet-stream'}).end(file);
    } catch {
      answer(response, 404, {code: 'NOT_FOUND', message: `${path}: there is no such file`});
    }
  }

  private async open(url: URL, request: IncomingMessage, response: ServerResponse): Promise<void> {
    const chunks: Buffer[] = [];
    for await (const chunk of request) chunks.push(chunk as Buffer);
    const link = url.searchParams.get('link');
    const right = link ? link === this.link : new URLSearchParams(Buffer.concat(chunks).toString()).get('token') === this.token;
    if (!right) return answer(response, 401, {code: 'UNAUTHENTICATED', message: 'not known'});
    if (link) this.link = undefined;
    response.writeHead(303, {Location: '/', 'Set-Cookie': `emberlock=${this.token}; HttpOnly; SameSite=Strict; Path=/`}).end();
  }

  /** Closes every console's WebSocket for this reason. */
  close(code: number): void {
    for (const {socket} of this.watchers) socket.close(code);
  }

  private async api(method: string, request: IncomingMessage, response: ServerResponse): Promise<void> {
    if (this.silent) return;
    if (!this.allowed(request)) return answer(response, 401, {code: 'UNAUTHENTICATED', message: 'the token is missing'});
    const chunks: Buffer[] = [];
    for await (const chunk of request) chunks.push(chunk as Buffer);
    const body = JSON.parse(Buffer.concat(chunks).toString() || '{}') as Record<string, unknown>;
    if (method === 'Daemon/GetStatus') return answer(response, 200, this.status);
    this.calls.push({method, request: body});
    try {
      const job = this.jobs[method];
      if (job) {
        response.writeHead(200, {'Content-Type': 'application/x-ndjson'});
        for await (const progress of job(body)) response.write(`${JSON.stringify(progress)}\n`);
        response.end();
        return;
      }
      const make = this.answers[method as keyof Calls] as ((request: object) => object) | undefined;
      answer(response, 200, make ? await make(body) : {});
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      answer(response, error.status, {code: error.code, message: error.message});
    }
  }
}

function answer(response: ServerResponse, status: number, body: object): void {
  response.writeHead(status, {'Content-Type': 'application/json'}).end(JSON.stringify(body));
}

export function pack(header: object, bytes: Uint8Array): Buffer {
  const text = Buffer.from(JSON.stringify(header));
  const length = Buffer.alloc(4);
  length.writeUInt32LE(text.length);
  return Buffer.concat([length, text, bytes]);
}
