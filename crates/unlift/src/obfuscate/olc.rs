//! Scheme `olc`: a uniformly random line through every point.

use std::sync::Arc;

use rayon::prelude::*;

use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::Error;
use crate::geometry::frame::Bounds;
use crate::released::{Lines, Obfuscation};
use crate::seed::{Key, Stage};

/// Random lines ("oriented line clouds").
#[derive(Clone, Copy, Debug)]
pub struct Olc;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "olc",
    facts: Facts {
        summary: "a random line through every point",
        source: "Speciale et al., Privacy Preserving Image-Based Localization, CVPR 2019",
        hidden: "the position along the line (1 of 3 coordinates)",
        patents: "EP 3818501 B1 / WO 2020/009829 \"3D line clouds\", Microsoft (US 16/025,120)",
    },
    in_2d: None,
    in_3d: Some(|_| Arc::new(Olc)),
};

impl<const D: usize> Scheme<D> for Olc {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn lift(
        &self,
        points: &[[f64; D]],
        _: Option<&Bounds<D>>,
        key: &Key,
    ) -> Result<Lifted<D>, Error> {
        let key = key.stage(Stage::Scheme);
        let direction = |row: usize| key.draws(row as u64).direction();
        let directions: Vec<[f64; D]> = (0..points.len()).into_par_iter().map(direction).collect();
        Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points, &directions)?)))
    }
}
