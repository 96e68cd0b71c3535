/** The code that wasm-bindgen generates; it precedes desk.js. */
declare const wasm_bindgen: any;

/** The part of Web Serial that the page uses. */
interface SerialPort {
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
  readonly readable: ReadableStream<Uint8Array> | null;
}
interface Navigator {
  readonly serial?: { requestPort(): Promise<SerialPort> };
}

/** Access to dropped folders. */
interface DirectoryReader {
  readEntries(take: (entries: Entry[]) => void, fail: (why: unknown) => void): void;
}
interface Entry {
  readonly isFile: boolean;
  readonly name: string;
  file(take: (file: File) => void, fail: (why: unknown) => void): void;
  createReader(): DirectoryReader;
}
interface Handle {
  readonly kind: "file" | "directory";
  readonly name: string;
  getFile(): Promise<File>;
  values(): AsyncIterable<Handle>;
}
