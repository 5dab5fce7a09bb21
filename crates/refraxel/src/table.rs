//! Tables and quantities as text.

/// A table whose first column stands left and whose others stand right.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these headings.
    pub fn new(headings: &[&str]) -> Self {
        Self { rows: vec![headings.iter().map(|&h| h.to_owned()).collect()] }
    }

    /// Adds a row; missing cells are empty.
    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// The lines, two spaces between columns.
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let length = |row: &Vec<String>, c: usize| row.get(c).map_or(0, |cell| cell.chars().count());
        let widths: Vec<usize> =
            (0..columns).map(|c| self.rows.iter().map(|r| length(r, c)).max().unwrap_or(0)).collect();
        let line = |row: &Vec<String>| {
            let cells = widths.iter().enumerate().map(|(c, &width)| {
                let cell = row.get(c).map_or("", String::as_str);
                if c == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
            cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        self.rows.iter().map(line).collect::<Vec<_>>().join("\n")
    }
}

/// A score to some decimals, "–" when there is none.
pub fn score(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".to_owned(), |v| format!("{v:.decimals$}"))
}

/// "3.2 GiB", "180 MiB", "12 KiB".
pub fn bytes(n: u64) -> String {
    let n = n as f64;
    let (value, unit) = match n {
        n if n >= 1e9 => (n / f64::from(1 << 30), "GiB"),
        n if n >= 1e6 => (n / f64::from(1 << 20), "MiB"),
        n => (n / 1024.0, "KiB"),
    };
    if value < 10.0 { format!("{value:.1} {unit}") } else { format!("{value:.0} {unit}") }
}

/// "1 234 567".
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|g| std::str::from_utf8(g).unwrap_or("")).collect();
    groups.join(" ")
}

/// Decimals that show three digits of what is as large as `size`, in any unit of length: so many at least.
pub fn decimals(size: f64, least: usize) -> usize {
    let needed = 2.0 - size.abs().log10().floor();
    if needed.is_finite() { (needed.clamp(0.0, 15.0) as usize).max(least) } else { least }
}

/// Absorption coefficients of linear red, green and blue.
pub fn colours([r, g, b]: [f32; 3]) -> String {
    let d = decimals(f64::from(10.0 * r.max(g).max(b)), 2);
    format!("red {r:.d$}, green {g:.d$}, blue {b:.d$} per scene unit")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_show_three_digits_in_any_unit() {
        let shown = |x: f64| format!("{x:.0$}", decimals(x, 3));
        let found = [2.5e-6, 0.0123, 0.5, 12.0, 3.2e6, 0.0].map(shown);
        assert_eq!(found, ["0.00000250", "0.0123", "0.500", "12.000", "3200000.000", "0.000"]);
        assert_eq!(colours([0.3, 0.0, 2.0]), "red 0.30, green 0.00, blue 2.00 per scene unit");
        assert_eq!(colours([3e-5, 0.0, 2e-4]), "red 0.00003, green 0.00000, blue 0.00020 per scene unit");
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut table = Table::new(&["run", "PSNR"]);
        table.row(vec!["straight".into(), "24.1".into()]);
        table.row(vec!["bent".into()]);
        assert_eq!(table.text(), "run       PSNR\nstraight  24.1\nbent");
    }

    #[test]
    fn quantities_are_short() {
        assert_eq!([bytes(12_288), bytes(190_000_000), bytes(3 << 30)], ["12 KiB", "181 MiB", "3.0 GiB"]);
        assert_eq!([count(7), count(1_234_567)], ["7", "1 234 567"]);
        assert_eq!([score(None, 2), score(Some(1.0), 3)], ["–", "1.000"]);
    }
}
