//! Shares and differences in words, by rules that hold over the whole range.

use crate::words;

/// A share of the points, in a word or two. Rises with the share; `all` and `none` are exact.
///
/// `percent` is 0 to 100.
pub(crate) fn amount(percent: f64) -> &'static str {
    match percent {
        100.0.. => "all",
        95.0.. => "almost all",
        80.0.. => "the great majority",
        55.0.. => "most",
        45.0.. => "about half",
        20.0.. => "a large part",
        5.0.. => "a small part",
        1.0.. => "few",
        _ if percent > 0.0 => "almost none",
        _ => "none",
    }
}

/// What is gained over a baseline, in percentage points, rounded down as all shares after "at least" are.
/// Nothing is said to be gained only where nothing is.
pub(crate) fn added(gain: f64) -> String {
    match gain {
        2.0.. => format!("{} percentage points", words::at_least(gain)),
        1.0.. => "1 percentage point".to_owned(),
        // The small lift keeps differences like 5.7 - 4.9 from losing a tenth to rounding.
        0.1.. => format!("{:.1} percentage points", ((gain + 1e-9) * 10.0).floor() / 10.0),
        _ if gain > 0.0 => "less than 0.1 percentage points".to_owned(),
        _ => "nothing".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 to 100 in steps of a tenth.
    fn range() -> impl Iterator<Item = f64> {
        (0..=1000).map(|tenth| f64::from(tenth) / 10.0)
    }

    #[test]
    fn words_for_shares_rise_with_the_share() {
        let order = [
            "none",
            "almost none",
            "few",
            "a small part",
            "a large part",
            "about half",
            "most",
            "the great majority",
            "almost all",
            "all",
        ];
        let rank = |percent| order.iter().position(|word| *word == amount(percent)).unwrap();
        let ranks: Vec<usize> = range().map(rank).collect();
        assert!(ranks.windows(2).all(|pair| pair[0] <= pair[1]));
        assert_eq!((ranks[0], ranks[1000]), (0, order.len() - 1));
        assert!((0..order.len()).all(|rank| ranks.contains(&rank)), "a word that is never said");
    }

    #[test]
    fn strong_words_are_kept_for_strong_shares() {
        for percent in range() {
            match amount(percent) {
                "none" => assert_eq!(percent, 0.0),
                "all" => assert_eq!(percent, 100.0),
                "almost all" => assert!(percent >= 95.0, "{percent}"),
                "almost none" => assert!(percent < 1.0, "{percent}"),
                "most" | "the great majority" => assert!(percent > 50.0, "{percent}"),
                "about half" => assert!((percent - 50.0).abs() <= 5.0, "{percent}"),
                "few" | "a small part" => assert!(percent < 20.0, "{percent}"),
                other => assert_eq!((other, percent < 50.0), ("a large part", true)),
            }
        }
        // What the earlier words had wrong.
        assert_ne!(amount(80.0), "almost all");
        assert_eq!(added(5.7 - 4.9), "0.8 percentage points");
    }

    #[test]
    fn nothing_is_added_only_where_nothing_is() {
        for gain in (-10_000..=10_000).map(|hundredth| f64::from(hundredth) / 100.0) {
            assert_eq!(added(gain) == "nothing", gain <= 0.0, "{gain}");
        }
        assert_eq!(added(0.05), "less than 0.1 percentage points");
        assert_eq!(added(0.99), "0.9 percentage points");
        assert_eq!(added(1.9), "1 percentage point");
        assert_eq!(added(87.99), "87 percentage points");
    }
}
