//! The information bound: the covariance of a pose that is estimated from all true matches of an image, at the true pose, with noise of
//! one pixel per coordinate.
//!
//! A match of a point with a keypoint gives two rows of the reprojection Jacobian. A record along which the point can move gives
//! one row, along the normal of the record's image: the other direction is free. A plane gives none. The covariance is the inverse
//! of the sum of the outer products of all rows.

use crate::geometry::camera::{Camera, PoseError};
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{cross, dot, widen};
use crate::obfuscate::{Scheme, obfuscate};
use crate::released::{Obfuscation, Released};
use crate::seed::{Key, Stage};
use crate::truth::{Original, Secret};
use crate::{Error, PointSet, Unit};
use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use unlift_attack::parallel;

/// Largest condition number of a pose that counts as determined.
const MAX_CONDITION: f64 = 1e12;

/// An image with its pose and the points that it observes.
///
/// The camera is a pinhole. Observations of other cameras must be undistorted. The bound takes them
/// at the true projections, so it needs no keypoints.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The camera, in the unit of the points.
    pub camera: Camera,
    /// Width and height of the image in pixels.
    pub size: [f64; 2],
    /// Rows of the points that the image observes.
    pub observed: Vec<u32>,
}

/// Returns for each original the direction along which its record leaves it free; `None` for those that
/// are free in two directions or an unknown one, or that the scheme left out. The swapped axis of axis
/// candidates counts as known, because a match can be verified under each axis.
pub fn free_directions<const D: usize>(
    released: &Released<D>,
    secret: &Secret,
) -> Vec<Option<[f64; D]>> {
    let of_slot = |slot: usize| -> Option<[f64; D]> {
        let record = slot / released.slots_per_record();
        match released.obfuscation() {
            Obfuscation::Lines(lines) => Some(widen(&lines.direction()[record])),
            // The distance of a camera from the center stays free; decoys would seem to fix it.
            bearings if bearings.is_bearings() => None,
            Obfuscation::Rays(rays) => Some(widen(&rays.direction()[record])),
            // In an image, an axis-parallel line; in space, a plane.
            Obfuscation::AxisPlanes(planes) => {
                (D == 2).then(|| unit_vector(1 - usize::from(planes.axis()[record])))
            }
            Obfuscation::AxisCandidates(_) => {
                secret.swapped_axis().map(|axes| unit_vector(axes[slot].into()))
            }
        }
    };
    let mut free = vec![None; secret.n_originals()];
    for (slot, original) in secret.hidden().iter().enumerate() {
        free[original.index()] = of_slot(slot);
    }
    free
}

fn unit_vector<const D: usize>(axis: usize) -> [f64; D] {
    std::array::from_fn(|c| f64::from(u8::from(c == axis)))
}

/// Returns the errors of all `views` with the points themselves.
pub fn unprotected(views: &[View], positions: &[[f64; 3]]) -> Vec<Option<PoseError>> {
    let of = |at: usize| {
        let view = &views[at];
        view.pose_error(view.observed.iter().map(|&row| (positions[row as usize], None)))
    };
    parallel::map(views.len(), of)
}

/// Returns the errors of all `views` with a protected map and keypoints in the clear.
pub fn with_map(
    views: &[View],
    positions: &[[f64; 3]],
    released: &Released<3>,
    secret: &Secret,
) -> Vec<Option<PoseError>> {
    let free = free_directions(released, secret);
    let of = |at: usize| {
        let view = &views[at];
        let known = view.observed.iter().filter_map(|&row| {
            let position = positions[row as usize];
            let direction = view.image_of(&position, &free[row as usize]?)?;
            Some((position, Some(direction)))
        });
        view.pose_error(known)
    };
    parallel::map(views.len(), of)
}

/// Returns the errors of all `views` with a map in the clear and keypoints that `scheme` protects.
pub fn with_queries(
    views: &[View],
    positions: &[[f64; 3]],
    scheme: &dyn Scheme<2>,
    key: &Key,
) -> Result<Vec<Option<PoseError>>, Error> {
    let of = |number: usize| {
        let view = &views[number];
        let inside = |row: &u32| {
            let place = view.camera.project(&positions[*row as usize])?;
            let is_inside = (0..2).all(|c| (0.0..=view.size[c]).contains(&place[c]));
            is_inside.then_some((*row, place))
        };
        let (rows, places): (Vec<u32>, Vec<[f64; 2]>) =
            view.observed.iter().filter_map(inside).unzip();
        if rows.is_empty() {
            return Ok(None);
        }
        let keypoints = PointSet::try_new(places, Unit::Pixel)?;
        let original = Original::within(keypoints, Bounds::try_new([0.0; 2], view.size)?)?;
        let key = key.of_item(Stage::Image, number as u64);
        let (released, secret) = obfuscate(scheme, &original, None, &key)?;
        let free = free_directions(&released, &secret);
        let known = secret.hidden().iter().filter_map(|hidden| {
            let direction = free[hidden.index()]?;
            Some((positions[rows[hidden.index()] as usize], Some(direction)))
        });
        Ok(view.pose_error(known))
    };
    parallel::map(views.len(), of).into_iter().collect()
}

impl View {
    /// Returns the derivative of the projection of `x`, in the camera's frame, by `x`.
    fn slopes(&self, x: &[f64; 3]) -> [[f64; 3]; 2] {
        let [fx, fy] = self.camera.intrinsics.focal;
        let z = x[2];
        [[fx / z, 0.0, -fx * x[0] / (z * z)], [0.0, fy / z, -fy * x[1] / (z * z)]]
    }

    /// Returns the direction in the image of a line through `point`; `None` behind the camera.
    fn image_of(&self, point: &[f64; 3], direction: &[f64; 3]) -> Option<[f64; 2]> {
        let x = self.camera.pose.in_camera(point);
        let turned = self.camera.pose.rotation.map(|row| dot(&row, direction));
        (x[2] > 0.0).then(|| self.slopes(&x).map(|row| dot(&row, &turned)))
    }

    /// Returns the deviations of the pose from points, each with the direction in the image that it leaves free, if any.
    ///
    /// The pose is perturbed from the left: `dx = w x x + dt` in the camera's frame.
    fn pose_error(
        &self,
        matches: impl Iterator<Item = ([f64; 3], Option<[f64; 2]>)>,
    ) -> Option<PoseError> {
        let mut information = Matrix6::zeros();
        let (mut depths, mut n) = (0.0, 0.0);
        for (point, free) in matches {
            let x = self.camera.pose.in_camera(&point);
            if x[2] <= 0.0 {
                continue;
            }
            (depths, n) = (depths + x[2], n + 1.0);
            let rows = self.slopes(&x).map(|j| {
                let by_rotation = cross(&x, &j);
                Vector6::new(by_rotation[0], by_rotation[1], by_rotation[2], j[0], j[1], j[2])
            });
            match free {
                None => rows.iter().for_each(|row| information += row * row.transpose()),
                Some(direction) => {
                    let length = libm::hypot(direction[0], direction[1]);
                    // A line toward the camera is a point in the image, which gives no normal.
                    if length > 0.0 {
                        let row = (rows[1] * direction[0] - rows[0] * direction[1]) / length;
                        information += row * row.transpose();
                    }
                }
            }
        }
        // In units of the mean depth, the condition number does not depend on the unit of the map.
        let depth = depths / n;
        if n == 0.0 {
            return None;
        }
        let scale = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, depth, depth, depth));
        let eigen = SymmetricEigen::new(scale * information * scale);
        let (min, max) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
        if min <= 0.0 || max / min > MAX_CONDITION || max.is_nan() {
            return None;
        }
        let variance = |c: usize| {
            let of = |k: usize| eigen.eigenvectors[(c, k)].powi(2) / eigen.eigenvalues[k];
            (0..6).map(of).sum::<f64>()
        };
        let root = |from: usize| (from..from + 3).map(variance).sum::<f64>().sqrt();
        Some(PoseError { center: depth * root(3), rotation_degrees: root(0).to_degrees() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Localization;
    use super::*;
    use crate::geometry::camera::{Intrinsics, Pose};
    use crate::obfuscate::all;
    use crate::synthetic;

    fn view(focal: f64, n: usize) -> View {
        View {
            camera: Camera {
                intrinsics: Intrinsics { focal: [focal; 2], principal: [320.0, 240.0] },
                pose: Pose::IDENTITY,
            },
            size: [640.0, 480.0],
            observed: (0..n as u32).collect(),
        }
    }

    /// Four points at depth `z` in a cross of radius `a` have a closed form.
    #[test]
    fn the_covariance_of_a_cross_of_points_is_the_analytic_one() {
        let (f, a, z) = (500.0, 0.7, 3.0);
        let points = [[a, 0.0, z], [-a, 0.0, z], [0.0, a, z], [0.0, -a, z]];
        let error = unprotected(&[view(f, 4)], &points)[0].unwrap();
        let q = a * a / (z * z);
        let across = (2.0 + 2.0 * q + q * q) * z * z / (2.0 * f * f * q * q);
        let along = z.powi(4) / (4.0 * f * f * a * a);
        let center = (2.0 * across + along).sqrt();
        let rotation = (2.0 / (f * f * q * q) + z * z / (4.0 * f * f * a * a)).sqrt();
        assert!((error.center / center - 1.0).abs() < 1e-9, "{error:?}, {center}");
        assert!((error.rotation_degrees / rotation.to_degrees() - 1.0).abs() < 1e-9);
        // Three points are enough for point matches, two are not.
        assert!(unprotected(&[view(f, 3)], &points)[0].is_some());
        assert_eq!(unprotected(&[view(f, 2)], &points), [None]);
    }

    /// A quarter of a furnished room, seen from its middle.
    fn room() -> (View, Original<3>) {
        let points = synthetic::room(1, 3_000).points;
        let middle = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / 3_000.0);
        // Forward is +y of the room, down is -z.
        let rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
        let mut base = view(500.0, 0);
        base.camera.pose = Pose { rotation, center: [middle[0], middle[1] - 1.0, 1.5] };
        let seen = |row: &u32| {
            let place = base.camera.project(&points[*row as usize]);
            place.is_some_and(|place| (0..2).all(|c| (0.0..base.size[c]).contains(&place[c])))
        };
        let observed: Vec<u32> = (0..points.len() as u32).filter(seen).collect();
        assert!(observed.len() > 200);
        let original = Original::new(PointSet::try_new(points, Unit::Meter).unwrap());
        (View { observed, ..base }, original)
    }

    /// Figures of this version. They change only if a scheme, its directions or the bound changes. Infinite: the view does not localize.
    #[test]
    fn multiples_of_the_room_are_as_before() {
        let golden = [
            ("olc", 1.4338500),
            ("ppl", 1.5411735),
            ("ppl+", 1.5441189),
            ("ray", 1.7362557),
            ("ray-voxel", 1.8347860),
            ("plane", f64::INFINITY),
            ("cp", 1.4357801),
            ("lines2d", 1.3952610),
            ("cp2d", 1.4062133),
            ("dcl2d", 2.1644814),
            // All bearings meet in the center, and decoys do not help.
            ("sphere", f64::INFINITY),
        ];
        let (view, original) = room();
        let views = [view];
        let positions = original.reveal().positions();
        let base = unprotected(&views, positions);
        let key = Key::from_seed(0);
        assert_eq!(all().count(), golden.len());
        for (entry, (name, golden)) in all().zip(golden) {
            let errors = match entry.dimensions() {
                2 => with_queries(&views, positions, entry, &key).unwrap(),
                _ => {
                    let (released, secret) = obfuscate(entry, &original, None, &key).unwrap();
                    with_map(&views, positions, &released, &secret)
                }
            };
            let multiple = Localization::of(entry.name, &errors, &base).multiple;
            let multiple = multiple.unwrap_or(f64::INFINITY);
            let same = multiple == golden || (multiple / golden - 1.0).abs() < 1e-6;
            assert!(entry.name == name && same, "{name}: {multiple}, expected {golden}");
        }
    }
}
