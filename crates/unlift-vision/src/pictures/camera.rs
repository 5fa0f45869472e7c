//! Projection of directions in a camera's frame into its image, for every camera model of COLMAP.
//!
//! Source: COLMAP's documentation ("Camera Models") and the papers it cites.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use unlift::Error;
use unlift::geometry::camera::{Intrinsics, Pose};

use super::inverter::check_size;

/// Number of angles tested for the fold of a model: 0.03 degrees apart.
const TRIED: usize = 6000;

/// The distortion of a camera model: radial `k`, tangential `p` and thin-prism `s`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// Perspective, radial distortion `(1 + k1 r2 + k2 r4 + k3 r6) / (1 + k4 r2 + k5 r4 + k6 r6)`.
    Perspective { k: [f64; 6], p: [f64; 2] },
    /// THIN_PRISM_FISHEYE: the angle with radial, tangential and thin-prism terms, added.
    ThinPrism { k: [f64; 6], p: [f64; 2], s: [f64; 2] },
    /// Fisheye: the angle from the axis, times `1 + k1 a2 + k2 a4 ..`, and the other terms of RAD_TAN_THIN_PRISM_FISHEYE.
    RadTan { k: [f64; 6], p: [f64; 2], s: [f64; 4] },
    /// FOV: one parameter, an angle.
    Fov(f64),
    /// Division: one parameter, by which the distorted radius is divided.
    Division(f64),
    /// EUCM: alpha and beta.
    Unified(f64, f64),
    /// The whole sphere: longitude and latitude.
    Equirectangular,
}

impl Kind {
    /// Returns the largest angle from the axis up to which the image radius increases.
    fn max_angle(&self) -> f64 {
        let all = match self {
            Self::Perspective { .. } | Self::Fov(_) | Self::Division(_) => FRAC_PI_2,
            _ => PI,
        };
        let angle = |at: usize| all * at as f64 / TRIED as f64;
        let mut last = 0.0;
        for at in 1..TRIED {
            match self.radial(angle(at)) {
                Some(place) if place > last => last = place,
                _ => return angle(at - 1),
            }
        }
        all
    }

    /// Returns the image radius by the radial terms alone; `None` beyond a pole.
    fn radial(&self, angle: f64) -> Option<f64> {
        Some(match self {
            Self::Perspective { k, .. } => {
                let flat = libm::tan(angle);
                let (r2, below) = (flat * flat, polynomial(&k[3..], flat * flat));
                if below <= 0.0 {
                    return None;
                }
                flat * polynomial(&k[..3], r2) / below
            }
            Self::RadTan { k, .. } | Self::ThinPrism { k, .. } => {
                angle * polynomial(k, angle * angle)
            }
            // These have no polynomial; `bent` detects their limits.
            Self::Fov(_) | Self::Division(_) | Self::Unified(..) | Self::Equirectangular => angle,
        })
    }
}

/// A camera's lens and sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    kind: Kind,
    /// Largest angle from the axis; beyond it the model folds back.
    max_angle: f64,
    focal: [f64; 2],
    center: [f64; 2],
}

impl Lens {
    /// Creates the lens of COLMAP's camera model `model` from its parameters, in COLMAP's order.
    ///
    /// # Errors
    /// If the model is unknown or has another number of parameters, or one is not finite.
    pub fn try_new(model: &str, params: &[f64]) -> Result<Self, Error> {
        if let Some(bad) = params.iter().find(|x| !x.is_finite()) {
            return Err(Error::new(model, "finite parameters", bad));
        }
        // Focal lengths (one or two), the center, then the distortion.
        let n_focal =
            if model.starts_with("SIMPLE_") || model.starts_with("RADIAL") { 1 } else { 2 };
        let n_before = if model == "EQUIRECTANGULAR" { 2 } else { n_focal + 2 };
        let f = |at: usize| params.get(at).copied().unwrap_or(0.0);
        let d = |at: usize| f(n_before + at);
        // The first `n` are radial, the others zero.
        let k = |n: usize| std::array::from_fn(|at| if at < n { d(at) } else { 0.0 });
        let radial = |n: usize| Kind::Perspective { k: k(n), p: [0.0; 2] };
        let fisheye = |n: usize| Kind::RadTan { k: k(n), p: [0.0; 2], s: [0.0; 4] };
        // Number of parameters of the distortion, and the distortion.
        let (n, kind) = match model {
            "SIMPLE_PINHOLE" | "PINHOLE" => (0, radial(0)),
            "SIMPLE_RADIAL" => (1, radial(1)),
            "RADIAL" => (2, radial(2)),
            "OPENCV" => (4, Kind::Perspective { k: k(2), p: [d(2), d(3)] }),
            "FULL_OPENCV" => {
                let k = [d(0), d(1), d(4), d(5), d(6), d(7)];
                (8, Kind::Perspective { k, p: [d(2), d(3)] })
            }
            "SIMPLE_FISHEYE" | "FISHEYE" => (0, fisheye(0)),
            "SIMPLE_RADIAL_FISHEYE" => (1, fisheye(1)),
            "RADIAL_FISHEYE" => (2, fisheye(2)),
            "OPENCV_FISHEYE" => (4, fisheye(4)),
            "THIN_PRISM_FISHEYE" => {
                let k = [d(0), d(1), d(4), d(5), 0.0, 0.0];
                (8, Kind::ThinPrism { k, p: [d(2), d(3)], s: [d(6), d(7)] })
            }
            "RAD_TAN_THIN_PRISM_FISHEYE" => {
                let (p, s) = ([d(6), d(7)], [d(8), d(9), d(10), d(11)]);
                (12, Kind::RadTan { k: k(6), p, s })
            }
            "FOV" => (1, Kind::Fov(d(0))),
            "SIMPLE_DIVISION" | "DIVISION" => (1, Kind::Division(d(0))),
            "EUCM" => (2, Kind::Unified(d(0), d(1))),
            "EQUIRECTANGULAR" => (0, Kind::Equirectangular),
            _ => {
                let name = model.escape_debug().to_string();
                return Err(Error::new("camera model", "one of COLMAP's", name));
            }
        };
        Error::check_len(model, params.len(), n_before + n, " parameters")?;
        let (focal, center) = match kind {
            // Its parameters are the size of the image.
            Kind::Equirectangular => ([f(0) / TAU, f(1) / PI], [f(0) / 2.0, f(1) / 2.0]),
            _ => ([f(0), f(n_focal - 1)], [f(n_focal), f(n_focal + 1)]),
        };
        Ok(Self { max_angle: kind.max_angle(), kind, focal, center })
    }

    /// Projects a point at `x` (right, down, forward) into the image, in pixels with the middle of
    /// the first pixel at (0, 0). `None` behind the camera, or where the model folds back.
    pub fn project(&self, x: [f64; 3]) -> Option<[f64; 2]> {
        let radius = libm::sqrt(x[0] * x[0] + x[1] * x[1]);
        if libm::atan2(radius, x[2]) > self.max_angle {
            return None;
        }
        let place = self.bent(x)?;
        let on = |c: usize| self.focal[c] * place[c] + self.center[c] - 0.5;
        let place = [on(0), on(1)];
        place.iter().all(|x| x.is_finite()).then_some(place)
    }

    /// Returns focal lengths and principal point, with the middle of the first pixel at (0, 0).
    pub fn intrinsics(&self) -> Intrinsics {
        Intrinsics { focal: self.focal, principal: self.center.map(|x| x - 0.5) }
    }

    /// Returns where a pinhole camera sees what this one sees at `place`.
    pub fn undistorted(&self, pinhole: &Intrinsics, place: [f64; 2]) -> Option<[f64; 2]> {
        let flat = self.undistort(place)?;
        Some([0, 1].map(|c| pinhole.focal[c] * flat[c] + pinhole.principal[c]))
    }

    /// Returns where the point that [`project`](Self::project) maps to `place` is on the plane at
    /// focal length one; `None` beyond a right angle from the axis, or without such a point.
    pub fn undistort(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let target = [0, 1].map(|c| (place[c] + 0.5 - self.center[c]) / self.focal[c]);
        let at = |flat: [f64; 2]| self.bent([flat[0], flat[1], 1.0]);
        let mut flat = target;
        // Newton's method with differences for derivatives.
        for _ in 0..20 {
            let now = at(flat)?;
            let off = [0, 1].map(|c| now[c] - target[c]);
            if off[0].abs().max(off[1].abs()) < 1e-12 {
                break;
            }
            let step = 1e-6;
            let (by_x, by_y) = (at([flat[0] + step, flat[1]])?, at([flat[0], flat[1] + step])?);
            let [a, c] = [0, 1].map(|k| (by_x[k] - now[k]) / step);
            let [b, d] = [0, 1].map(|k| (by_y[k] - now[k]) / step);
            let determinant = a * d - b * c;
            flat[0] -= (d * off[0] - b * off[1]) / determinant;
            flat[1] -= (a * off[1] - c * off[0]) / determinant;
        }
        let back = self.project([flat[0], flat[1], 1.0])?;
        // A hundredth of a pixel; beyond a fold, the iteration ends elsewhere.
        (0..2).all(|c| (back[c] - place[c]).abs() < 1e-2).then_some(flat)
    }

    /// Returns the position on the plane at focal length one.
    fn bent(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        let flat = [x / z, y / z];
        let radius = libm::sqrt(x * x + y * y);
        // The angle from the axis, in the direction of the point.
        let angle = libm::atan2(radius, z);
        let angular = match radius > 0.0 {
            true => [x / radius * angle, y / radius * angle],
            false => [0.0; 2],
        };
        let squared = |p: [f64; 2]| p[0] * p[0] + p[1] * p[1];
        let tangential = |[u, v]: [f64; 2], r2: f64, [p1, p2]: [f64; 2]| {
            let across = 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u);
            let down = 2.0 * p2 * u * v + p1 * (r2 + 2.0 * v * v);
            [across, down]
        };
        let place = match &self.kind {
            Kind::Perspective { k, p } => {
                let r2 = squared(flat);
                let (above, below) = (polynomial(&k[..3], r2), polynomial(&k[3..], r2));
                let moved = tangential(flat, r2, *p);
                [0, 1].map(|c| flat[c] * above / below + moved[c])
            }
            Kind::ThinPrism { k, p, s } => {
                let r2 = squared(angular);
                let moved = tangential(angular, r2, *p);
                [0, 1].map(|c| angular[c] * polynomial(k, r2) + moved[c] + s[c] * r2)
            }
            Kind::RadTan { k, p, s } => {
                let radial = angular.map(|x| x * polynomial(k, angle * angle));
                let r2 = squared(radial);
                // Here the first tangential parameter is horizontal.
                let moved = tangential(radial, r2, [p[1], p[0]]);
                [0, 1].map(|c| radial[c] + moved[c] + s[2 * c] * r2 + s[2 * c + 1] * r2 * r2)
            }
            Kind::Fov(omega) => {
                let r = libm::sqrt(squared(flat));
                let factor = match r > 0.0 && *omega != 0.0 {
                    true => libm::atan(2.0 * r * libm::tan(omega / 2.0)) / (r * omega),
                    false if *omega != 0.0 => 2.0 * libm::tan(omega / 2.0) / omega,
                    false => 1.0,
                };
                flat.map(|x| x * factor)
            }
            Kind::Division(k) => {
                let under = 1.0 - 4.0 * k * squared(flat);
                if under < 0.0 {
                    return None;
                }
                flat.map(|x| 2.0 * x / (1.0 + libm::sqrt(under)))
            }
            Kind::Unified(alpha, beta) => {
                let far = libm::sqrt(beta * (x * x + y * y) + z * z);
                let depth = alpha * far + (1.0 - alpha) * z;
                if depth <= 0.0 {
                    return None;
                }
                [x / depth, y / depth]
            }
            Kind::Equirectangular => {
                let level = libm::sqrt(x * x + z * z);
                [libm::atan2(x, z), libm::atan2(y, level)]
            }
        };
        Some(place)
    }
}

/// Returns `1 + k1 x + k2 x^2 ..`.
fn polynomial(k: &[f64], x: f64) -> f64 {
    1.0 + x * k.iter().rev().fold(0.0, |sum, k| k + x * sum)
}

/// A camera with its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The pose, in units of the map.
    pub pose: Pose,
    /// The lens.
    pub lens: Lens,
    /// Width and height of the image in pixels.
    pub size: [usize; 2],
}

/// The points of a map that project into an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Projection {
    /// Indices of the points, ascending.
    pub points: Vec<u32>,
    /// Positions `(n, 2)` in pixels, the middle of the first pixel at (0, 0).
    pub places: Vec<[f32; 2]>,
    /// Distances from the camera, `(n,)`, in units of the map.
    pub depths: Vec<f32>,
}

/// Side of a window of the occlusion test in pixels.
const WINDOW: usize = 16;
/// A point is hidden if it is farther than others by this factor.
const BEHIND: f32 = 1.15;
/// Number of nearer points that hide a point; fewer may be outliers.
const ENOUGH: usize = 3;

impl View {
    /// Projects points into the image, hidden or not. Skips positions that are `None` or not finite.
    ///
    /// # Errors
    /// If the image is too large for a feature image.
    pub fn project(&self, points: &[Option<[f64; 3]>]) -> Result<Projection, Error> {
        check_size(self.size)?;
        let mut projection = Projection::default();
        for (at, point) in points.iter().enumerate() {
            let Some(point) = point else { continue };
            let x = self.pose.in_camera(point);
            let Some(place) = self.lens.project(x) else { continue };
            if (0..2).all(|c| place[c] >= -0.5 && place[c] < self.size[c] as f64 - 0.5) {
                projection.points.push(at as u32);
                projection.places.push(place.map(|x| x as f32));
                projection.depths.push(libm::sqrt(x.iter().map(|x| x * x).sum::<f64>()) as f32);
            }
        }
        Ok(projection)
    }
}

impl Projection {
    /// Keeps the points for whose row `keep` is true.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.points.len()).filter(|&at| keep(at)).collect();
        Self {
            points: kept.iter().map(|&at| self.points[at]).collect(),
            places: kept.iter().map(|&at| self.places[at]).collect(),
            depths: kept.iter().map(|&at| self.depths[at]).collect(),
        }
    }

    /// Returns which points are visible. A point is hidden if at least three points in the window
    /// around it are clearly nearer. Where points are sparse, some hidden ones pass.
    pub fn visible(&self, size: [usize; 2]) -> Vec<bool> {
        let [width, height] = size.map(|side| side.div_ceil(WINDOW / 2));
        // Cells have half the side of a window, and each point checks the four nearest.
        let cell = |place: [f32; 2]| place.map(|x| (x + 0.5).max(0.0) / (WINDOW / 2) as f32);
        let mut depths: Vec<Vec<f32>> = vec![Vec::new(); width * height];
        for (place, depth) in self.places.iter().zip(&self.depths) {
            let [x, y] = cell(*place).map(|x| x as usize);
            depths[y.min(height - 1) * width + x.min(width - 1)].push(*depth);
        }
        let hidden = |(place, depth): (&[f32; 2], &f32)| {
            let [x, y] = cell(*place);
            let around = |x: f32, n_cells: usize| {
                let low = (x - 0.5).floor().max(0.0) as usize;
                low..=(low + 1).min(n_cells - 1)
            };
            let before = around(y, height)
                .flat_map(|y| around(x, width).map(move |x| y * width + x))
                .flat_map(|cell| &depths[cell])
                .filter(|nearer| **nearer * BEHIND < *depth);
            before.take(ENOUGH).count() == ENOUGH
        };
        self.places.iter().zip(&self.depths).map(|point| !hidden(point)).collect()
    }
}
