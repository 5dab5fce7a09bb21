//! An XML element, and typed access whose errors name file and place.

use crate::DataError;
use roxmltree::Node;
use std::path::Path;

/// One element with the name of its place, for messages.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    pub path: &'a Path,
    pub place: &'a str,
    pub node: Node<'a, 'a>,
}

/// The first child of a name.
pub(super) fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

impl Element<'_> {
    /// Numbers in the text of a child, where there is such a child.
    pub fn numbers<const N: usize>(
        &self,
        name: &str,
        expected: &'static str,
    ) -> Result<Option<[f64; N]>, DataError> {
        let Some(node) = child(self.node, name) else { return Ok(None) };
        let text = node.text().unwrap_or_default();
        let numbers = text.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()));
        let numbers = numbers.take(N + 1).collect::<Option<Vec<f64>>>().and_then(|n| n.try_into().ok());
        numbers.map(Some).ok_or_else(|| self.wrong(name, text, expected))
    }

    /// The number in the text of a child; 0 where there is none.
    pub fn number(&self, name: &str) -> Result<f64, DataError> {
        self.numbers::<1>(name, "a finite number").map(|found| found.map_or(0.0, |[v]| v))
    }

    /// A number in an attribute.
    pub fn size(&self, node: Node, name: &str) -> Result<f64, DataError> {
        let text = node.attribute(name).unwrap_or("missing");
        let found = text.parse().ok().filter(|v: &f64| (1.0..=1e6).contains(v));
        found.ok_or_else(|| self.wrong(name, text, "a size from 1 to 1000000 pixels"))
    }

    /// The error that something of this element is not `expected`.
    pub fn wrong(&self, name: &str, found: &str, expected: &'static str) -> DataError {
        let found = format!("{:?}", found.trim().chars().take(80).collect::<String>());
        let (path, key) = (self.path.to_owned(), format!("{}: {name}", self.place));
        DataError::Value { path, key, found, expected }
    }

    /// The error that something would silently give wrong rays.
    pub fn unsupported(&self, name: &str, advice: &'static str) -> DataError {
        let (path, key) = (self.path.to_owned(), format!("{}: {name}", self.place));
        DataError::UnsupportedFeature { path, key, advice }
    }
}
