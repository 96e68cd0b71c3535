/** What wasm-bindgen puts above desk.js. */
declare const wasm_bindgen: any;

/** Web Serial, as far as it is used. */
interface SerialPort {
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
  readonly readable: ReadableStream<Uint8Array> | null;
}
interface Navigator {
  readonly serial?: { requestPort(): Promise<SerialPort> };
}

/** Folders that are dropped. */
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
