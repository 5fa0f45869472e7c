//! What is read of a scan.

/// Points of a scan.
#[derive(Debug)]
pub struct Scan {
    /// `(n, 3)`, all finite.
    pub positions: Vec<[f64; 3]>,
    /// The name of the format, for people.
    pub format: &'static str,
    /// What was found but not used, one line each.
    pub notes: Vec<String>,
    /// Why figures of the points may be too small, one line each.
    pub doubts: Vec<String>,
}

impl Scan {
    /// With a note on points without a place, of which scanners store many: a beam that nothing threw back.
    pub fn new(positions: Vec<[f64; 3]>, format: &'static str, n_without: u64) -> Self {
        let n = n_without + positions.len() as u64;
        let note = (n_without > 0).then(|| format!("{n_without} of {n} points have no place"));
        Self { positions, format, notes: note.into_iter().collect(), doubts: Vec::new() }
    }
}
