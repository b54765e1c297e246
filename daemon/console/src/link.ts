// SPDX-License-Identifier: Apache-2.0
// The WebSocket: what the daemon tells, as it tells it; and again from the start when the connection was lost.
import type {AlignmentStatus, DaemonStatus, IterationPreview, Notice, RoundPoint} from './api.gen';
import {ApiError, type BinaryHeader, call, decode, unpack} from './wire';

export type Connection = 'connecting' | 'open' | 'lost' | 'token' | 'displaced';

export interface Listener {
  connection(state: Connection): void;
  status(status: DaemonStatus): void;
  notice(notice: Notice): void;
  iteration(preview: IterationPreview): void;
  bytes(header: BinaryHeader, bytes: Uint8Array): void;
}

const kQuiet = 3000;           // ms without a word after which the daemon is asked whether it is there
const kDisplaced = 4001;       // the daemon's reason to close: it has as many consoles as it may, and a newer one came
const kLongestWait = 2000;     // ms between tries to connect again

const ask = () => call('Daemon/GetStatus', {}, AbortSignal.timeout(2000));

export class Link {
  private socket?: WebSocket;
  private history?: RoundPoint[];
  private wait = 250;
  private heard = 0;
  private asking = false;
  private timer?: number;
  private wanted: {camera_ids: string[]; rate_hz: number} | null = null;

  constructor(private readonly listener: Listener) {
    setInterval(() => void this.checkQuiet(), 500);
    addEventListener('online', () => this.hurry());
    document.addEventListener('visibilitychange', () => { if (!document.hidden) this.hurry(); });
    addEventListener('pagehide', () => this.socket?.close());
    this.connect();
  }

  /** Asks for live pictures of these cameras, so many a second at most; null: of none. */
  watch(wanted: {camera_ids: string[]; rate_hz: number} | null): void {
    if (JSON.stringify(wanted) === JSON.stringify(this.wanted)) return;
    this.wanted = wanted;
    this.sendWatch();
  }

  /** Gives the daemon the token, which it answers with a cookie. False: it isn't the right one. */
  async unlock(token: string): Promise<boolean> {
    const answer = await fetch('/open', {method: 'POST', body: new URLSearchParams({token}), credentials: 'same-origin'}).catch(() => undefined);
    if (!answer?.ok) return false;
    this.connect();
    return true;
  }

  private connect(): void {
    clearTimeout(this.timer);
    this.listener.connection('connecting');
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/api/v1/watch`);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.history = undefined;
    this.heard = performance.now();
    socket.onopen = () => {
      this.wait = 250;
      this.listener.connection('open');
      this.sendWatch();
    };
    socket.onmessage = event => this.receive(event.data as string | ArrayBuffer);
    socket.onclose = ({code}) => {
      if (this.socket !== socket) return;
      if (code !== kDisplaced) return void this.lost();
      // Two that came back each time would displace each other for ever.
      this.socket = undefined;
      this.listener.connection('displaced');
    };
  }

  private receive(data: string | ArrayBuffer): void {
    this.heard = performance.now();
    if (typeof data !== 'string') {
      this.listener.bytes(...unpack(data));
      return;
    }
    const message = JSON.parse(data) as {rounds?: unknown; status?: unknown; notice?: unknown; iteration?: unknown};
    if (message.rounds) this.history = (decode('AlignmentStatus', message.rounds) as AlignmentStatus).history;
    if (message.status) this.listener.status(this.whole(decode('DaemonStatus', message.status) as DaemonStatus));
    if (message.notice) this.listener.notice(decode('Notice', message.notice) as Notice);
    if (message.iteration) this.listener.iteration(decode('IterationPreview', message.iteration) as IterationPreview);
  }

  // The history of rounds is long: it comes by itself, when it changed.
  private whole(status: DaemonStatus): DaemonStatus {
    if (status.alignment && this.history) status.alignment.history = this.history;
    return status;
  }

  private sendWatch(): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({watch: this.wanted}));
  }

  // A WebSocket that is refused doesn't say why: a call does.
  private async lost(): Promise<void> {
    this.socket = undefined;
    this.listener.connection('lost');
    const answer = await ask().catch((error: unknown) => error);
    if (answer instanceof ApiError && answer.status === 401) {
      this.listener.connection('token');
      return;
    }
    if (this.socket) return;  // somebody was in a hurry
    this.timer = window.setTimeout(() => this.connect(), this.wait);
    this.wait = Math.min(2 * this.wait, kLongestWait);
  }

  // A network that swallows everything closes nothing.
  private async checkQuiet(): Promise<void> {
    const socket = this.socket;
    if (socket?.readyState !== WebSocket.OPEN || this.asking || performance.now() - this.heard < kQuiet) return;
    this.asking = true;
    const answer = await ask().catch(() => undefined);
    this.asking = false;
    if (answer) {
      this.heard = performance.now();
      this.listener.status(answer);
    } else if (this.socket === socket) {
      socket.onclose = null;
      socket.close();
      void this.lost();
    }
  }

  private hurry(): void {
    if (this.socket) return;
    this.wait = 250;
    this.connect();
  }
}
