//! Files that unpack to a thousand times their size, byte by byte.

/// A stream of DEFLATE that unpacks to a head, stored as it is, and so many million equal bytes; a million takes a kilobyte.
pub(crate) fn deflated(head: &[u8], byte: u8, millions: usize) -> Vec<u8> {
    let mut out = vec![0];
    let (length, head) = (head.len() as u16, head);
    out.extend(length.to_le_bytes());
    out.extend((!length).to_le_bytes());
    out.extend(head);
    let mut bits = Bits { out, held: 0, count: 0 };
    // The last block, with its own codes: two lengths of codes, then 1 bit for a match of 258 bytes, 1 bit for its distance.
    bits.put(0b101, 3);
    // 286 codes of literals and lengths, 1 of distances, 18 lengths of code lengths
    bits.put(286 - 257, 5);
    bits.put(0, 5);
    bits.put(18 - 4, 4);
    // their own lengths, two bits for each of the symbols 0, 1, 2, and 18, which is a run of zeros
    for symbol in [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1] {
        bits.put(if matches!(symbol, 0 | 1 | 2 | 18) { 2 } else { 0 }, 3);
    }
    // the codes 01, 10 and 11, from the highest bit
    let (one, two, run) = (0b10, 0b01, 0b11);
    let zeros = |bits: &mut Bits, mut count: usize| {
        while count >= 11 {
            let some = count.min(138);
            bits.put(run, 2);
            bits.put(some - 11, 7);
            count -= some;
        }
        (0..count).for_each(|_| bits.put(0, 2));
    };
    // lengths of codes: 2 of the byte, 2 of the block's end, 1 of the length 258; 1 of the distance
    zeros(&mut bits, byte.into());
    bits.put(two, 2);
    zeros(&mut bits, 255 - usize::from(byte));
    bits.put(two, 2);
    zeros(&mut bits, 285 - 257);
    bits.put(one, 2);
    bits.put(one, 2);
    // 285 is 0; of the codes of length 2 the byte is 10, the end 11
    bits.put(0b01, 2);
    for _ in 0..millions * 1_000_000 / 258 {
        bits.put(0b00, 2);
    }
    bits.put(0b11, 2);
    bits.put(0, 7);
    bits.out
}

struct Bits {
    out: Vec<u8>,
    held: u32,
    count: u32,
}

impl Bits {
    fn put(&mut self, value: usize, count: u32) {
        self.held |= (value as u32) << self.count;
        self.count += count;
        while self.count >= 8 {
            self.out.push(self.held as u8);
            self.held >>= 8;
            self.count -= 8;
        }
    }
}

/// A file of gzip; its checksum is wrong, which a reader that refuses it in time never sees.
pub(crate) fn gzip(deflated: &[u8]) -> Vec<u8> {
    let head = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
    [&head[..], deflated, &[0; 8]].concat()
}

/// An archive with one packed member.
pub(crate) fn zip(name: &str, deflated: &[u8], unpacked_bytes: u32) -> Vec<u8> {
    archive(&[(name, deflated)], 8, |_| unpacked_bytes)
}

/// An archive with members that are stored as they are.
pub(crate) fn zip_stored(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let members: Vec<(&str, &[u8])> =
        members.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    archive(&members, 0, |bytes| bytes.len() as u32)
}

fn archive(members: &[(&str, &[u8])], method: u16, length: impl Fn(&[u8]) -> u32) -> Vec<u8> {
    let (mut out, mut listed) = (Vec::new(), Vec::new());
    for (name, bytes) in members {
        let mut shared = Vec::new();
        // version 2.0, no flags, no date, no checksum
        for half in [20_u16, 0, method, 0, 0] {
            shared.extend(half.to_le_bytes());
        }
        let checksum = if method == 0 { crc32(bytes) } else { 0 };
        for word in [checksum, bytes.len() as u32, length(bytes)] {
            shared.extend(word.to_le_bytes());
        }
        shared.extend((name.len() as u16).to_le_bytes());
        shared.extend(0_u16.to_le_bytes());
        let begin = out.len() as u32;
        out.extend(b"PK\x03\x04");
        out.extend(&shared);
        out.extend(name.bytes());
        out.extend(*bytes);
        listed.extend(b"PK\x01\x02\x14\x00");
        listed.extend(&shared);
        listed.extend([0; 10]);
        listed.extend(begin.to_le_bytes());
        listed.extend(name.bytes());
    }
    let (listed_at, count) = (out.len() as u32, members.len() as u16);
    let length = listed.len() as u32;
    out.extend(listed);
    out.extend(b"PK\x05\x06\x00\x00\x00\x00");
    out.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    out.extend(length.to_le_bytes());
    out.extend(listed_at.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// CRC-32 as archives have it.
fn crc32(bytes: &[u8]) -> u32 {
    let table: Vec<u32> = (0..256_u32)
        .map(|n| (0..8).fold(n, |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 }))
        .collect();
    !bytes.iter().fold(!0, |c, byte| table[((c ^ u32::from(*byte)) & 0xff) as usize] ^ (c >> 8))
}
