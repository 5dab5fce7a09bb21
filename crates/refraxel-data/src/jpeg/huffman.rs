//! Huffman codes of a sequential JPEG, read and thrown away. Source: ITU-T T.81, annexes C and F.

use super::marker::next_marker;

/// Bits of codes that are looked up at once.
const SHORT: u32 = 11;

/// A table of codes.
pub(super) struct Table {
    /// Length and symbol of the code that [`SHORT`] bits begin with; length 0: it is longer.
    short: Box<[(u8, u8); 1 << SHORT]>,
    /// Per length: the first code, the number of codes, and where their symbols begin.
    long: [(u32, u32, usize); 17],
    symbols: Vec<u8>,
}

/// Why a code cannot be read.
pub(super) enum Broken {
    /// There are no more bits.
    End,
    /// There is no such code.
    Code,
}

impl Table {
    /// A table, and what follows it; `None` where it contradicts itself.
    pub fn read(content: &[u8]) -> Option<(Self, &[u8])> {
        let (counts, rest) = content.split_at_checked(16)?;
        let total = counts.iter().map(|&n| usize::from(n)).sum();
        let (symbols, rest) = rest.split_at_checked(total)?;
        let short = Box::new([(0, 0); 1 << SHORT]);
        let mut table = Self { short, long: [(0, 0, 0); 17], symbols: symbols.to_vec() };
        let (mut code, mut from) = (0_u32, 0);
        for (length, &count) in (1_u32..).zip(counts) {
            table.long[length as usize] = (code, count.into(), from);
            for &symbol in &symbols[from..from + usize::from(count)] {
                if code >> length != 0 {
                    return None;
                }
                if length <= SHORT {
                    let first = (code << (SHORT - length)) as usize;
                    table.short[first..first + (1 << (SHORT - length))].fill((length as u8, symbol));
                }
                code += 1;
            }
            from += usize::from(count);
            code <<= 1;
        }
        Some((table, rest))
    }
}

/// The bits of a scan.
pub(super) struct Bits<'a> {
    rest: &'a [u8],
    held: u64,
    count: u32,
}

impl<'a> Bits<'a> {
    pub fn new(rest: &'a [u8]) -> Self {
        Self { rest, held: 0, count: 0 }
    }

    /// Holds a code of 16 bits and what belongs to it, at most 16 more, as far as there are bits; a marker ends them.
    #[inline]
    fn fill(&mut self) {
        if self.count >= 32 {
            return;
        }
        match self.rest.split_first_chunk() {
            Some((next, rest)) if !next.contains(&0xff) => {
                self.held = self.held << 32 | u64::from(u32::from_be_bytes(*next));
                (self.count, self.rest) = (self.count + 32, rest);
            }
            _ => self.fill_bytewise(),
        }
    }

    #[cold]
    fn fill_bytewise(&mut self) {
        while self.count <= 48 {
            let (byte, length) = match *self.rest {
                [0xff, 0, ..] => (0xff, 2),
                [0xff, ..] | [] => return,
                [byte, ..] => (byte, 1),
            };
            self.rest = &self.rest[length..];
            self.held = self.held << 8 | u64::from(byte);
            self.count += 8;
        }
    }

    #[inline]
    fn take(&mut self, bits: u32) -> Result<(), Broken> {
        self.count = self.count.checked_sub(bits).ok_or(Broken::End)?;
        Ok(())
    }

    /// Length and symbol of the next code.
    #[inline]
    fn code(&mut self, table: &Table) -> Result<(u32, u8), Broken> {
        self.fill();
        let ahead =
            if self.count >= 16 { self.held >> (self.count - 16) } else { self.held << (16 - self.count) };
        let ahead = (ahead & 0xffff) as u32;
        match table.short[(ahead >> (16 - SHORT)) as usize] {
            (0, _) => self.long_code(table, ahead),
            (length, symbol) => Ok((length.into(), symbol)),
        }
    }

    #[cold]
    fn long_code(&self, table: &Table, ahead: u32) -> Result<(u32, u8), Broken> {
        for length in SHORT + 1..=16 {
            let (first, count, from) = table.long[length as usize];
            let code = ahead >> (16 - length);
            if (first..first + count).contains(&code) {
                return Ok((length, table.symbols[from + (code - first) as usize]));
            }
        }
        Err(if self.count < 16 { Broken::End } else { Broken::Code })
    }

    /// Reads the 64 coefficients of a block.
    pub fn block(&mut self, dc: &Table, ac: &Table) -> Result<(), Broken> {
        let (length, size) = self.code(dc)?;
        if size > 16 {
            return Err(Broken::Code);
        }
        self.take(length + u32::from(size))?;
        let mut k = 1;
        while k < 64 {
            let (length, symbol) = self.code(ac)?;
            let (run, size) = (u32::from(symbol >> 4), u32::from(symbol & 15));
            self.take(length + size)?;
            match (run, size) {
                (15, 0) => k += 16,
                (_, 0) => return Ok(()),
                _ => k += run + 1,
            }
        }
        if k > 64 { Err(Broken::Code) } else { Ok(()) }
    }

    /// Bytes before the next marker that no code has taken.
    pub fn left(&self) -> usize {
        let ends = |w: &[u8]| w[0] == 0xff && w[1] != 0;
        let before = self.rest.windows(2).position(ends).unwrap_or(self.rest.len());
        self.count as usize / 8 + before
    }

    /// Goes on behind a restart marker; false where there is none within so many bytes.
    pub fn restart(&mut self, padding: usize) -> bool {
        if self.left() > padding {
            return false;
        }
        match next_marker(self.rest) {
            Some((0xd0..=0xd7, after)) => {
                *self = Self::new(after);
                true
            }
            _ => false,
        }
    }

    /// What no code has taken.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }
}
