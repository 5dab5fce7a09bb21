use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::surface::{Canvas, Colour};

/// Size and weight of text; Noto Sans Mono in Latin-1, other letters appear as '?'.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Font {
    /// 16 pixels high.
    Body,
    /// 16 pixels high, bold.
    Strong,
    /// 20 pixels high, bold.
    Heading,
}

impl Font {
    /// Height of a line [pixel].
    pub fn height(self) -> usize {
        self.raster().1.val()
    }

    /// The look of text in this font.
    pub fn style(self, align: Align, colour: Colour) -> Style {
        Style { font: self, align, colour }
    }

    fn raster(self) -> (FontWeight, RasterHeight) {
        match self {
            Self::Body => (FontWeight::Regular, RasterHeight::Size16),
            Self::Strong => (FontWeight::Bold, RasterHeight::Size16),
            Self::Heading => (FontWeight::Bold, RasterHeight::Size20),
        }
    }
}

/// Which part of a text lies at the given x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Its left end.
    Left,
    /// Its middle.
    Centre,
    /// Its right end.
    Right,
}

/// How a line of text looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Size and weight.
    pub font: Font,
    /// Which part of the text lies at its place.
    pub align: Align,
    /// Its colour.
    pub colour: Colour,
}

/// Width of one line of text [pixel].
pub fn text_width(font: Font, text: &str) -> usize {
    let (weight, height) = font.raster();
    text.chars().count() * get_raster_width(weight, height)
}

impl Canvas {
    /// Writes one line whose upper edge is at `y`; its left end, middle or right end at `x`, by the alignment [pixel].
    pub fn text(&mut self, (x, y): (i64, i64), text: &str, style: Style) {
        let width = text_width(style.font, text) as i64;
        let mut left = match style.align {
            Align::Left => x,
            Align::Centre => x - width / 2,
            Align::Right => x - width,
        };
        let (weight, height) = style.font.raster();
        for letter in text.chars() {
            let glyph = get_raster(letter, weight, height).or_else(|| get_raster('?', weight, height));
            for (dy, row) in glyph.iter().flat_map(|g| g.rows()).enumerate() {
                for (dx, &ink) in row.iter().enumerate() {
                    self.mix(left + dx as i64, y + dy as i64, style.colour, f32::from(ink) / 255.0);
                }
            }
            left += get_raster_width(weight, height) as i64;
        }
    }
}

impl Canvas {
    /// [`Self::text`] with a rim of the colour of the `paper`, so that it can be read where lines run.
    pub fn text_on_lines(&mut self, (x, y): (i64, i64), text: &str, style: Style, paper: Colour) {
        let rim = Style { colour: paper, ..style };
        for (dx, dy) in (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (dx, dy))) {
            self.text((x + dx, y + dy), text, rim);
        }
        self.text((x, y), text, style);
    }
}

/// `text`, its end replaced by ".." where it is longer than `width` [pixel].
pub fn shortened(font: Font, text: &str, width: usize) -> String {
    if text_width(font, text) <= width {
        return text.to_owned();
    }
    let letters = width / text_width(font, "m");
    let kept: String = text.chars().take(letters.saturating_sub(2)).collect();
    kept + &".."[..letters.min(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inked_columns(canvas: &Canvas) -> Vec<usize> {
        (0..canvas.width())
            .filter(|&x| (0..canvas.height()).any(|y| canvas.pixel(x, y) != [255; 3]))
            .collect()
    }

    #[test]
    fn alignment_moves_the_same_ink() {
        let draw = |x, align| {
            let mut canvas = Canvas::new(100, 20, [255; 3]);
            canvas.text((x, 2), "HIJ", Font::Body.style(align, [0; 3]));
            inked_columns(&canvas)
        };
        let width = text_width(Font::Body, "HIJ");
        let left = draw(30, Align::Left);
        assert!(!left.is_empty() && left[0] >= 30 && left[left.len() - 1] < 30 + width);
        assert_eq!(left, draw(30 + width as i64, Align::Right));
        assert_eq!(left, draw(30 + width as i64 / 2, Align::Centre));
    }

    #[test]
    fn unknown_letters_become_question_marks() {
        let draw = |text| {
            let mut canvas = Canvas::new(40, 20, [255; 3]);
            canvas.text((0, 0), text, Font::Strong.style(Align::Left, [0; 3]));
            canvas
        };
        assert_eq!(draw("\u{4e2d}"), draw("?"));
        assert_ne!(draw("°"), draw("?"));
    }

    #[test]
    fn shortened_text_fits() {
        assert_eq!(shortened(Font::Body, "truth", 500), "truth");
        for width in 0..80 {
            let text = shortened(Font::Body, "a_rather_long_name.png", width);
            assert!(text_width(Font::Body, &text) <= width, "{width}: {text}");
        }
        assert_eq!(
            shortened(Font::Body, "a_rather_long_name.png", 8 * text_width(Font::Body, "m")),
            "a_rath.."
        );
    }
}
