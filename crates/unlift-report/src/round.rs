//! Rounding to significant digits, which keeps a document's text short and stable.

use serde::Serialize;
use serde_json::Value;

/// Significant decimal digits of every measured number in `audit.json`.
///
/// Six digits resolve a micron in a meter, far below any threshold and far above the rounding noise
/// of sums.
pub const SIGNIFICANT_DIGITS: usize = 6;

/// Rounds `value` to [`SIGNIFICANT_DIGITS`]; zero and non-finite values stay unchanged.
pub(crate) fn round(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    // Rounding through decimal text is exact; `(value * 10^n).round() / 10^n` leaves a tail of
    // nines.
    format!("{value:.*e}", SIGNIFICANT_DIGITS - 1).parse().unwrap_or(value)
}

/// Returns `value` as JSON, with numbers rounded as in `audit.json`.
///
/// # Errors
/// Fails if `value` cannot be JSON.
pub fn rounded(value: &impl Serialize) -> serde_json::Result<Value> {
    let mut value = serde_json::to_value(value)?;
    round_floats(&mut value);
    Ok(value)
}

/// Rounds every float in `value`; integers keep all digits.
pub(crate) fn round_floats(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            if let Some(rounded) = number.as_f64().map(round).and_then(serde_json::Number::from_f64)
            {
                *number = rounded;
            }
        }
        Value::Array(items) => items.iter_mut().for_each(round_floats),
        Value::Object(fields) => fields.values_mut().for_each(round_floats),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits_are_kept_at_any_magnitude() {
        assert_eq!(round(1.234_567_89), 1.234_57);
        assert_eq!(round(89.123_456_7), 89.123_5);
        assert_eq!(round(1.234_567_89e-9), 1.234_57e-9);
        assert_eq!(round(-0.1 - 0.2), -0.3);
        assert_eq!(round(0.0), 0.0);
    }
}
