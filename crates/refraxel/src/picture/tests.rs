use super::*;

fn flat(colour: Colour, width: usize, height: usize) -> Vec<Colour> {
    vec![colour; width * height]
}

fn panel<'a>(content: Content<'a>, note: &str) -> Panel<'a> {
    Panel { content, note: note.to_owned() }
}

fn count(page: &Canvas, colour: Colour) -> usize {
    (0..page.height()).map(|y| (0..page.width()).filter(|&x| page.pixel(x, y) == colour).count()).sum()
}

#[test]
fn small_images_are_enlarged_by_a_whole_factor() {
    let pixels = flat([10, 200, 30], 50, 20);
    let image = Rgb8::new(&pixels, 50, 20);
    let rows = vec![vec![panel(Content::Image(image), "")]];
    let page =
        Comparison { title: String::new(), columns: vec!["truth".into()], rows, full_error: 64 }.draw();
    assert_eq!(count(&page, [10, 200, 30]), 200 * 80);
}

#[test]
fn large_images_are_averaged() {
    let pixels: Vec<Colour> = (0..1200 * 4).map(|i| [if i % 2 == 0 { 100 } else { 102 }; 3]).collect();
    let tile = Tile::new(Content::Image(Rgb8::new(&pixels, 1200, 4)), 64);
    assert_eq!((tile.width, tile.height), (600, 2));
    assert!(tile.pixels.iter().all(|p| *p == [101; 3]));
}

#[test]
fn thin_images_keep_a_pixel() {
    let pixels = flat([1; 3], 2000, 1);
    let tile = Tile::new(Content::Image(Rgb8::new(&pixels, 2000, 1)), 64);
    assert_eq!((tile.width, tile.height), (2000, 1));
}

#[test]
fn error_grows_from_black_to_the_last_colour() {
    let (truth, near, far) = (flat([50; 3], 200, 4), flat([50, 50, 50], 200, 4), flat([200; 3], 200, 4));
    let colours = |a: &[Colour]| error_colours(Rgb8::new(a, 200, 4), Rgb8::new(&truth, 200, 4), 64);
    assert_eq!(colours(&near)[0], ColourMap::Inferno.at(0.0));
    assert_eq!(colours(&far)[0], ColourMap::Inferno.at(1.0));
}

#[test]
fn only_error_panels_bring_a_colour_bar() {
    let pixels = flat([90; 3], 200, 100);
    let image = Rgb8::new(&pixels, 200, 100);
    let width = |content| {
        let rows = vec![vec![panel(content, "")]];
        Comparison { title: String::new(), columns: vec!["a".into()], rows, full_error: 64 }.draw().width()
    };
    assert_eq!(width(Content::Error(image, image)), width(Content::Image(image)) + BAR_SPACE);
}

#[test]
fn page_without_rows_is_still_a_page() {
    let page =
        Comparison { title: "none".into(), columns: vec!["a".into()], rows: vec![], full_error: 0 }.draw();
    assert!(page.width() > 0 && page.height() > 0);
}

#[test]
#[should_panic(expected = "a panel per column")]
fn missing_panel_is_refused() {
    let rows = vec![vec![]];
    Comparison { title: String::new(), columns: vec!["a".into()], rows, full_error: 64 }.draw();
}
