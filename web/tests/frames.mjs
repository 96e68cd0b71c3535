/*
 * Prints the data of a simulated board on the live link: 600 frames, of which one is lost, one is damaged and one is sent twice.
 */

/** CRC-32C of an ASCII text. */
const crc = (text) => {
  let sum = 0xffffffff;
  for (const letter of text) {
    sum ^= letter.charCodeAt(0);
    for (let k = 0; k < 8; k += 1) sum = (sum >>> 1) ^ (sum & 1 ? 0x82f63b78 : 0);
  }
  return ((sum ^ 0xffffffff) >>> 0).toString(16).toUpperCase().padStart(8, "0");
};

const frame = (counter) => {
  const code = Math.round(2200 + 400 * Math.sin(counter / 40));
  const answer = counter < 10 ? ",W," : `${Math.round(170000 - 9000 * Math.sin(counter / 40))},${Math.cos(counter / 40) > 0 ? "I" : "D"},0`;
  const body = `S1,${counter},${1000 + 10 * counter},${counter === 300 ? -1 : code},${counter === 300 ? ",M," : answer}`;
  return `$${body}*${crc(body)}\n`;
};

const lines = Array.from({ length: 600 }, (_, counter) => frame(counter));
lines[100] = "";
lines[200] = lines[200].replace("S1", "S9");
lines[400] += lines[400];
process.stdout.write(lines.join(""));
