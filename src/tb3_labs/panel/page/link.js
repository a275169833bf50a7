// The socket to the node `panel`. A lost socket connects again. Each answer goes to its request.

const RETRY_PERIOD = 1000;    // [ms] between two attempts to connect
const MAX_SILENCE = 4000;    // [ms] without a message for this time, the connection is broken
const ANSWER_TIMEOUT = 6000;    // [ms] without an answer for this time, a request has failed

export class Link {
  /** `handlers` is {type of a message: function of the message}. Its function `connection` gets
   *  true when the page connects, and false when the connection is lost. */
  constructor(handlers) {
    this.isConnected = false;
    this._handlers = handlers;
    this._socket = null;
    this._lastId = 0;
    this._waiting = new Map();       // {id of a request: function of the answer}
    this._receivedAt = 0;
    this.stops = null;            // number of stops in the latest picture
    this._clock = null;           // of the latest picture: {panelTime [s], arrivedAt [ms]}
    setInterval(() => this._watch(), 500);
    this._connect();
  }

  /** Send a message. Returns false if there is no connection. */
  send(message) {
    if (!this._socket || this._socket.readyState !== WebSocket.OPEN) return false;
    this._socket.send(JSON.stringify(message));
    return true;
  }

  /** The time [s] on the panel's clock, minus the delay of the latest picture. So the panel may
   *  overestimate the delay of a message, but never underestimates it. */
  get time() {
    if (!this._clock) return null;
    return this._clock.panelTime + (performance.now() - this._clock.arrivedAt) / 1000;
  }

  /** Send a person's request. The returned promise gives {ok, text}, and never fails. */
  ask(message, within = ANSWER_TIMEOUT) {
    const id = ++this._lastId;
    return new Promise((resolve) => {
      if (!this.send({...message, id, t: this.time, stops: this.stops})) {
        resolve({ok: false, text: 'not connected'});
        return;
      }
      const timer = setTimeout(() => this._answered(id, {ok: false, text: 'no answer'}), within);
      this._waiting.set(id, (answer) => { clearTimeout(timer); resolve(answer); });
    });
  }

  _answered(id, answer) {
    const resolve = this._waiting.get(id);
    this._waiting.delete(id);
    if (resolve) resolve(answer);
  }

  _connect() {
    const url = new URL('socket' + location.search, location.href.split(/[?#]/)[0]);
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    const socket = new WebSocket(url);
    this._socket = socket;
    this._receivedAt = performance.now();
    // Events of an older socket are ignored.
    socket.onmessage = (event) => { if (socket === this._socket) this._onText(event.data); };
    socket.onclose = () => { if (socket === this._socket) this._lost(); };
  }

  _onText(text) {
    this._receivedAt = performance.now();
    const message = JSON.parse(text);
    if (message.type === 'hello') {
      this.isConnected = true;
      this.stops = null;
      this._clock = null;
      this._handlers.connection(true);
    } else if (message.type === 'answer') {
      this._answered(message.id, message);
    } else if (message.type === 'picture') {
      this.stops = message.stops;
      this._clock = {panelTime: message.now, arrivedAt: performance.now()};
    }
    this._handlers[message.type]?.(message);
  }

  _lost() {
    const socket = this._socket;
    this._socket = null;
    socket.onclose = null;
    socket.close();
    for (const id of [...this._waiting.keys()]) {
      this._answered(id, {ok: false, text: 'the connection broke'});
    }
    if (this.isConnected) {
      this.isConnected = false;
      this._handlers.connection(false);
    }
    setTimeout(() => this._connect(), RETRY_PERIOD);
  }

  _watch() {
    // A broken network does not close the socket, so the page closes a silent socket.
    if (this._socket && performance.now() - this._receivedAt > MAX_SILENCE) this._lost();
  }
}
