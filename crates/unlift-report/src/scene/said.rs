//! What the 3D view draws and what it does not, in words: every point is counted once.

use super::Shapes;
use crate::words;

/// What became of the points of one pane.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Fate {
    /// Points that are drawn.
    pub drawn: usize,
    /// Points that the scheme's rule did not release.
    pub withheld: usize,
    /// Released points without a position after recovery.
    pub lost: usize,
    /// Points outside the box that is drawn.
    pub outside: usize,
}

impl Fate {
    /// "3,861 of 3,895 points drawn; 34 not released".
    pub(crate) fn said(&self) -> String {
        let count = |n: usize| words::thousands(n as u64);
        let all = self.drawn + self.withheld + self.lost + self.outside;
        let others = [
            (self.withheld, "not released"),
            (self.lost, "lost"),
            (self.outside, "outside the box"),
        ];
        let others: Vec<String> = others
            .into_iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| format!("{} {what}", count(n)))
            .collect();
        if others.is_empty() {
            return format!("{} points drawn", count(all));
        }
        let drawn = match self.drawn {
            0 => format!("None of {}", count(all)),
            n => format!("{} of {}", count(n), count(all)),
        };
        format!("{drawn} points drawn; {}", others.join(", "))
    }
}

/// "1,500 of 3,895 lines drawn".
pub(crate) fn shapes(shapes: &Shapes, drawn: usize, n_records: u64) -> String {
    let what = match shapes {
        Shapes::Segments(_) => "lines",
        Shapes::Patches(_) => "planes",
        Shapes::Points(_) => "points",
    };
    let all = words::thousands(n_records.max(drawn as u64));
    match drawn as u64 >= n_records {
        true => format!("{all} {what} drawn"),
        false => format!("{} of {all} {what} drawn", words::thousands(drawn as u64)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pane_without_points_says_why() {
        let fate = Fate { lost: 3_895, ..Fate::default() };
        assert_eq!(fate.said(), "None of 3,895 points drawn; 3,895 lost");
        assert_eq!(Fate { drawn: 4_000, ..Fate::default() }.said(), "4,000 points drawn");
    }

    #[test]
    fn shapes_are_a_sample() {
        let lines = Shapes::Segments(Vec::new());
        assert_eq!(shapes(&lines, 1_500, 3_895), "1,500 of 3,895 lines drawn");
        assert_eq!(shapes(&lines, 9, 9), "9 lines drawn");
    }
}
