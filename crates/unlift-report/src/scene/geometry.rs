//! The box around a scene, records clipped to it, and the choice of points to show.

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneBox {
    /// Smallest corner.
    pub low: [f32; 3],
    /// Largest corner.
    pub high: [f32; 3],
}

impl SceneBox {
    /// Returns the box from the 1st to the 99th percentile of each coordinate, widened by a tenth
    /// of its longest side. Percentiles exclude far outliers, which would shrink the scene to a
    /// dot.
    ///
    /// Ignores non-finite coordinates; without points it starts from the unit cube about the
    /// origin.
    pub fn robust(points: &[[f32; 3]]) -> Self {
        let mut low = [-0.5; 3];
        let mut high = [0.5; 3];
        for axis in 0..3 {
            let mut values: Vec<f32> =
                points.iter().map(|p| p[axis]).filter(|x| x.is_finite()).collect();
            if values.is_empty() {
                continue;
            }
            values.sort_unstable_by(f32::total_cmp);
            let last = values.len() - 1;
            low[axis] = values[last / 100];
            high[axis] = values[last - last / 100];
        }
        let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f32::max);
        let margin = if longest > 0.0 { 0.1 * longest } else { 0.5 };
        for axis in 0..3 {
            low[axis] -= margin;
            high[axis] += margin;
        }
        Self { low, high }
    }

    /// Returns the part in the box of the line through `point` along `direction`; `None` if the
    /// line misses the box or `direction` is zero.
    pub fn clip_line(&self, point: [f32; 3], direction: [f32; 3]) -> Option<[[f32; 3]; 2]> {
        self.clip(point, direction, f32::NEG_INFINITY)
    }

    /// Returns the part in the box of the half-line from `center`, like [`SceneBox::clip_line`].
    pub fn clip_ray(&self, center: [f32; 3], direction: [f32; 3]) -> Option<[[f32; 3]; 2]> {
        self.clip(center, direction, 0.0)
    }

    fn clip(&self, point: [f32; 3], direction: [f32; 3], from: f32) -> Option<[[f32; 3]; 2]> {
        let (mut near, mut far) = (from, f32::INFINITY);
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - point[axis], self.high[axis] - point[axis]);
            if direction[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / direction[axis], high / direction[axis]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        if !near.is_finite() || !far.is_finite() || near >= far {
            return None;
        }
        let at = |t: f32| std::array::from_fn(|axis| point[axis] + t * direction[axis]);
        Some([at(near), at(far)])
    }

    /// Returns the rectangle of the plane `coordinate[axis] == offset` in the box; `None` if it is
    /// outside.
    pub fn axis_patch(&self, axis: usize, offset: f32) -> Option<[[f32; 3]; 4]> {
        if !(self.low[axis]..=self.high[axis]).contains(&offset) {
            return None;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |a: f32, b: f32| {
            let mut point = [offset; 3];
            point[u] = a;
            point[v] = b;
            point
        };
        Some([
            corner(self.low[u], self.low[v]),
            corner(self.high[u], self.low[v]),
            corner(self.high[u], self.high[v]),
            corner(self.low[u], self.high[v]),
        ])
    }
}

/// Returns at most `max` of the indices `0..n`, ascending, chosen by a hash of the index and
/// `seed`. The choice is equal on every machine and independent of the order of a map file.
pub fn subsample(n: usize, max: usize, seed: u64) -> Vec<usize> {
    if n <= max {
        return (0..n).collect();
    }
    let mut keyed: Vec<(u64, usize)> = (0..n).map(|i| (mix(seed, i as u64), i)).collect();
    if max == 0 {
        return Vec::new();
    }
    keyed.select_nth_unstable(max - 1);
    keyed.truncate(max);
    let mut indices: Vec<usize> = keyed.into_iter().map(|(_, i)| i).collect();
    indices.sort_unstable();
    indices
}

fn mix(seed: u64, counter: u64) -> u64 {
    let mut z = seed.wrapping_add(counter.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: SceneBox = SceneBox { low: [-1.0; 3], high: [1.0; 3] };

    #[test]
    fn a_line_ends_at_the_faces() {
        let segment = CUBE.clip_line([0.0, 0.5, 0.0], [2.0, 0.0, 0.0]).unwrap();
        assert_eq!(segment, [[-1.0, 0.5, 0.0], [1.0, 0.5, 0.0]]);
        assert_eq!(CUBE.clip_line([0.0, 2.0, 0.0], [1.0, 0.0, 0.0]), None);
        assert_eq!(CUBE.clip_line([0.0; 3], [0.0; 3]), None);
    }

    #[test]
    fn a_ray_starts_at_its_center_or_at_a_face() {
        assert_eq!(CUBE.clip_ray([0.0; 3], [0.0, 0.0, 1.0]).unwrap()[0], [0.0; 3]);
        assert_eq!(CUBE.clip_ray([0.0, 0.0, -5.0], [0.0, 0.0, 1.0]).unwrap()[0], [0.0, 0.0, -1.0]);
        assert_eq!(CUBE.clip_ray([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]), None);
    }

    #[test]
    fn outliers_do_not_stretch_the_box() {
        let mut points: Vec<[f32; 3]> = (0..1000).map(|i| [i as f32 / 1000.0; 3]).collect();
        points.push([1e6, -1e6, f32::NAN]);
        let scene = SceneBox::robust(&points);
        assert!(scene.low.iter().all(|&x| (-0.2..0.0).contains(&x)), "{scene:?}");
        assert!(scene.high.iter().all(|&x| (1.0..1.2).contains(&x)), "{scene:?}");
    }

    #[test]
    fn a_subsample_is_deterministic_and_of_the_asked_size() {
        let chosen = subsample(10_000, 100, 7);
        assert_eq!(chosen.len(), 100);
        assert!(chosen.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(chosen, subsample(10_000, 100, 7));
        assert_ne!(chosen, subsample(10_000, 100, 8));
        assert_eq!(subsample(3, 100, 0), [0, 1, 2]);
        assert!(subsample(3, 0, 0).is_empty());
    }
}
