//! Rays: half-lines from a small table of published centers.

use super::normal_form::{finite_f32, unit_direction};
use crate::Error;
use crate::geometry::frame::Bounds;

/// Half-lines `center + t direction`, `t > 0`; `center` is an index into a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Rays<const D: usize> {
    centers: Vec<[f32; D]>,
    center: Vec<u8>,
    direction: Vec<[f32; D]>,
    regions: Option<Vec<Bounds<D>>>,
}

impl<const D: usize> Rays<D> {
    /// Creates rays from `centers[center[i]]` along `direction[i]`, which points from the center to the hidden point.
    ///
    /// # Errors
    /// When there are no or more than 255 centers, the columns differ in length, a center index is
    /// out of range, or a row is not finite or has no direction.
    pub fn try_new(
        centers: &[[f64; D]],
        center: Vec<u8>,
        directions: &[[f64; D]],
    ) -> Result<Self, Error> {
        if centers.is_empty() || centers.len() > 255 {
            return Err(Error::new("ray centers", "1 to 255", centers.len().to_string()));
        }
        if center.len() != directions.len() {
            let expected = format!("{} rows", center.len());
            return Err(Error::new("ray directions", expected, directions.len().to_string()));
        }
        if let Some(row) = center.iter().position(|&c| usize::from(c) >= centers.len()) {
            let what = format!("center of record {row}");
            let expected = format!("an index below {}", centers.len());
            return Err(Error::new(what, expected, center[row].to_string()));
        }
        let centers = centers
            .iter()
            .enumerate()
            .map(|(row, &c)| finite_f32(c, "center table entry", row))
            .collect::<Result<_, _>>()?;
        let direction = directions
            .iter()
            .enumerate()
            .map(|(row, &d)| {
                Ok(finite_f32(unit_direction(d, row)?, "direction", row)?.map(|x| x + 0.0))
            })
            .collect::<Result<_, Error>>()?;
        Ok(Self { centers, center, direction, regions: None })
    }

    /// Returns the rows `order[0], order[1], ...`.
    pub fn select(&self, order: &[u32]) -> Self {
        Self {
            centers: self.centers.clone(),
            center: super::normal_form::rows(&self.center, order),
            direction: super::normal_form::rows(&self.direction, order),
            regions: self.regions.clone(),
        }
    }

    /// Declares that the region of a point decides its center. `regions` has, per center, the box of its points, relative to the released
    /// origin. It is a public rule of the scheme.
    ///
    /// # Errors
    /// When there is not one region per center.
    pub fn with_regions(self, regions: Vec<Bounds<D>>) -> Result<Self, Error> {
        if regions.len() != self.centers.len() {
            let expected = format!("{}, one per center", self.centers.len());
            return Err(Error::new("regions", expected, regions.len().to_string()));
        }
        Ok(Self { regions: Some(regions), ..self })
    }

    /// Box of the points of each center, relative to the released origin, if declared.
    pub fn regions(&self) -> Option<&[Bounds<D>]> {
        self.regions.as_deref()
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.center.len()
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.center.is_empty()
    }

    /// The published centers.
    pub fn centers(&self) -> &[[f32; D]] {
        &self.centers
    }

    /// Index of the center of each ray, which is its group.
    pub fn center(&self) -> &[u8] {
        &self.center
    }

    /// Unit direction of each ray, away from its center.
    pub fn direction(&self) -> &[[f32; D]] {
        &self.direction
    }
}
