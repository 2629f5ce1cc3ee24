//! Text with values of reports: `{case > quantity > decimals}` or `{case > quantity > decimals > factor}`;
//! with `e2` instead of decimals in scientific notation.

use miette::{Result, miette};

/// Marker behind a filled part.
const END: &str = "<!-- end -->";

/// Placeholders of a text: case, quantity, decimals, factor (empty if it is not given).
pub fn placeholders(text: &str) -> impl Iterator<Item = [&str; 4]> {
    let inner = text.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(inner, _)| inner);
    inner.filter_map(parts)
}

fn parts(placeholder: &str) -> Option<[&str; 4]> {
    let mut parts = placeholder.split(" > ").map(str::trim);
    let found = [parts.next()?, parts.next()?, parts.next()?, parts.next().unwrap_or_default()];
    parts.next().is_none().then_some(found)
}

/// Replaces each placeholder by the value times the factor, rounded to the decimals.
///
/// # Errors
/// A placeholder without three or four parts, an unknown value, decimals or a factor that are not numbers.
pub fn fill(text: &str, value: impl Fn(&str, &str) -> Option<f64>) -> Result<String> {
    let mut filled = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        let (inner, after) = after.split_once('}').ok_or_else(|| miette!("`{{` without `}}`"))?;
        let [case, quantity, decimals, factor] =
            parts(inner).ok_or_else(|| miette!("`{inner}`: expected `case > quantity > decimals`"))?;
        let found = value(case, quantity).ok_or_else(|| miette!("{case} has no value `{quantity}`"))?;
        let (scientific, digits) =
            decimals.strip_prefix('e').map_or((false, decimals), |digits| (true, digits));
        let digits: usize = digits.parse().map_err(|_| miette!("`{inner}`: decimals"))?;
        let factor: f64 =
            if factor.is_empty() { "1" } else { factor }.parse().map_err(|_| miette!("`{inner}`: factor"))?;
        filled += before;
        let number = found * factor;
        filled += &if scientific {
            format!("{number:.digits$e}")
        } else {
            format!("{number:.digits$}").replace('-', "−")
        };
        rest = after;
    }
    Ok(filled + rest)
}

/// Replaces what stands between `<!-- values: NAME -->` and `<!-- end -->`.
///
/// # Errors
/// Error of a missing marker.
pub fn replace(text: &str, name: &str, filled: &str) -> Result<String> {
    let begin = format!("<!-- values: {name} -->\n");
    let (before, rest) = text.split_once(&begin).ok_or_else(|| miette!("missing `{}`", begin.trim_end()))?;
    let (_, after) = rest.split_once(END).ok_or_else(|| miette!("missing `{END}` after `{name}`"))?;
    Ok(format!("{before}{begin}\n{}\n\n{END}{after}", filled.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_in_text() {
        let value =
            |case: &str, name: &str| (case == "plate" && name == "peak[dx=1mm m=3]").then_some(-0.0316);
        let text = "| {plate > peak[dx=1mm m=3] > 2} | {plate > peak[dx=1mm m=3] > 1 > 100} % |";
        assert_eq!(fill(text, value).expect("text"), "| −0.03 | −3.2 % |");
        let found: Vec<_> =
            placeholders(text).map(|[case, _, decimals, factor]| [case, decimals, factor]).collect();
        assert_eq!(found, [["plate", "2", ""], ["plate", "1", "100"]]);
        assert_eq!(fill("{plate > peak[dx=1mm m=3] > e1}", value).expect("text"), "-3.2e-2");
        for wrong in ["{plate > none > 1}", "{plate}", "{plate > peak[dx=1mm m=3] > x}", "{"] {
            assert!(fill(wrong, value).is_err(), "{wrong}");
        }
        let page = "a\n<!-- values: t -->\nold\n<!-- end -->\nb\n";
        let new = replace(page, "t", "new\n").expect("text");
        assert_eq!(new, "a\n<!-- values: t -->\n\nnew\n\n<!-- end -->\nb\n");
        assert_eq!(replace(&new, "t", "new").expect("text"), new);
        assert!(replace(page, "u", "").is_err());
    }
}
