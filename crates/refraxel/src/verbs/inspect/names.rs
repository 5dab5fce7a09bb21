//! What views are called, and their order.

use refraxel_data::{Dataset, Part};
use std::collections::HashSet;

/// The part of the split in which each view is: `train`, `val`, `test`, or `unused`.
pub fn parts(data: &Dataset) -> Vec<&'static str> {
    let mut parts = vec!["unused"; data.views.len()];
    for part in Part::ALL {
        for &view in part.views(data) {
            if let Some(of_view) = parts.get_mut(view) {
                *of_view = part.name();
            }
        }
    }
    parts
}

/// A name for each view: that of its file; where two parts have files of one name, the part stands before all names.
pub fn labels(data: &Dataset) -> Vec<String> {
    let distinct: HashSet<&str> = data.views.iter().map(|view| &*view.name).collect();
    let are_clear = distinct.len() == data.views.len();
    let named = data.views.iter().zip(parts(data));
    named.map(|(v, part)| if are_clear { v.name.clone() } else { format!("{part}/{}", v.name) }).collect()
}

/// The indices of names in the order in which people count: `r_2` before `r_10`.
pub fn by_name(names: &[String]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_cached_key(|&i| (pieces(&names[i]), names[i].clone()));
    order
}

/// Each letter, and each number as one piece that sorts by its value.
fn pieces(name: &str) -> Vec<(char, usize, String)> {
    let mut pieces: Vec<(char, usize, String)> = Vec::new();
    for letter in name.chars() {
        match pieces.last_mut() {
            Some(('0', length, digits)) if letter.is_ascii_digit() => {
                if digits == "0" {
                    digits.clear();
                }
                digits.push(letter);
                *length = digits.len();
            }
            _ if letter.is_ascii_digit() => pieces.push(('0', 1, letter.to_string())),
            _ => pieces.push((letter, 0, String::new())),
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_sort_by_their_value() {
        let names = ["r_10.png", "r_2.png", "a.png", "r_002.png", "r_1.png", "r_01b.png"].map(str::to_owned);
        let sorted: Vec<&str> = by_name(&names).into_iter().map(|i| &*names[i]).collect();
        assert_eq!(sorted, ["a.png", "r_1.png", "r_01b.png", "r_002.png", "r_2.png", "r_10.png"]);
    }
}
