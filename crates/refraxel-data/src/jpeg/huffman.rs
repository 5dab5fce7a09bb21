//! Huffman codes of a sequential JPEG, read and thrown away. Source: ITU-T T.81, annexes C and F.

use super::marker::next_marker;

/// A table of codes.
pub(super) struct Table {
    /// Length and symbol of the code that eight bits begin with; length 0: it is longer.
    short: [(u8, u8); 256],
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
        let mut table = Self { short: [(0, 0); 256], long: [(0, 0, 0); 17], symbols: symbols.to_vec() };
        let (mut code, mut from) = (0_u32, 0);
        for (length, &count) in (1_u32..).zip(counts) {
            table.long[length as usize] = (code, count.into(), from);
            for &symbol in &symbols[from..from + usize::from(count)] {
                if code >> length != 0 {
                    return None;
                }
                if length <= 8 {
                    let first = (code << (8 - length)) as usize;
                    table.short[first..first + (1 << (8 - length))].fill((length as u8, symbol));
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

    /// Holds as many bits as there are, up to 48 and more; a marker ends them.
    fn fill(&mut self) {
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

    fn take(&mut self, bits: u32) -> Result<(), Broken> {
        self.count = self.count.checked_sub(bits).ok_or(Broken::End)?;
        Ok(())
    }

    /// The next symbol.
    fn symbol(&mut self, table: &Table) -> Result<u8, Broken> {
        self.fill();
        let ahead =
            if self.count >= 16 { self.held >> (self.count - 16) } else { self.held << (16 - self.count) };
        let ahead = (ahead & 0xffff) as u32;
        let (length, symbol) = table.short[(ahead >> 8) as usize];
        if length > 0 {
            self.take(length.into())?;
            return Ok(symbol);
        }
        for length in 9..=16 {
            let (first, count, from) = table.long[length as usize];
            let code = ahead >> (16 - length);
            if (first..first + count).contains(&code) {
                self.take(length)?;
                return Ok(table.symbols[from + (code - first) as usize]);
            }
        }
        Err(if self.count < 16 { Broken::End } else { Broken::Code })
    }

    /// Reads the 64 coefficients of a block.
    pub fn block(&mut self, dc: &Table, ac: &Table) -> Result<(), Broken> {
        let size = self.symbol(dc)?;
        if size > 16 {
            return Err(Broken::Code);
        }
        self.take(size.into())?;
        let mut k = 1;
        while k < 64 {
            let symbol = self.symbol(ac)?;
            let (run, size) = (u32::from(symbol >> 4), u32::from(symbol & 15));
            match (run, size) {
                (15, 0) => k += 16,
                (_, 0) => return Ok(()),
                _ => {
                    k += run + 1;
                    self.take(size)?;
                }
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
