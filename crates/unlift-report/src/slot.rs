//! The color and mark of a scheme.

use std::collections::HashSet;

use crate::document::Document;

/// Schemes with a color and a mark of their own, the same on every page.
const KNOWN_SCHEMES: [&str; 7] = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"];
/// Colors and marks there are; further schemes reuse them in turn.
const SLOTS: usize = 8;

/// The color and mark of `scheme`; unknown ones take turns in the order they appear.
pub(crate) fn slot(document: &Document, scheme: &str) -> usize {
    // Schemes for images have the color of the scheme for maps that they are most like.
    let known = match scheme {
        "lines2d" => "olc",
        "cp2d" => "cp",
        "dcl2d" => "ray",
        other => other,
    };
    if let Some(slot) = KNOWN_SCHEMES.iter().position(|name| *name == known) {
        return slot;
    }
    let names = document.results.iter().map(|row| row.scheme.as_str());
    let before: HashSet<&str> = names
        .take_while(|name| *name != scheme)
        .filter(|name| !KNOWN_SCHEMES.contains(name))
        .collect();
    (KNOWN_SCHEMES.len() + before.len()) % SLOTS
}
