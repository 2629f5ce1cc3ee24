//! Axes: ranges, ticks and their labels.

/// A linear or logarithmic axis.
pub(super) struct PlotAxis {
    log: bool,
    /// Ends, logarithms on a logarithmic axis.
    low: f64,
    high: f64,
    /// Values and labels.
    pub(super) ticks: Vec<(f64, String)>,
    /// Values of unlabelled ticks.
    pub(super) minor: Vec<f64>,
}

/// Empty space beyond the data, as a share of the axis.
const PADDING: f64 = 0.04;

impl PlotAxis {
    /// Around `values`, which are finite, and positive on a logarithmic axis; or exactly from `range`.
    pub(super) fn new(
        values: impl Iterator<Item = f64>,
        range: Option<(f64, f64)>,
        log: bool,
        most: usize,
    ) -> Self {
        let scale = |value: f64| if log { value.log10() } else { value };
        let (low, high) = match range {
            Some((low, high)) => (scale(low), scale(high)),
            None => {
                let [low, high] = polycore::numerics::range(values.map(scale));
                let span = high - low;
                let least = if log { 0.1 } else { 1e-6 * low.abs().max(high.abs()).max(f64::MIN_POSITIVE) };
                let padding = if span > least { PADDING * span } else { 10.0 * least };
                (low - padding, high + padding)
            }
        };
        let mut axis = Self { log, low, high, ticks: Vec::new(), minor: Vec::new() };
        if log {
            axis.logarithmic(most)
        } else {
            axis.linear(most)
        }
        axis
    }

    /// Returns the position of a value: 0 at the lower end, 1 at the upper.
    pub(super) fn share(&self, value: f64) -> f64 {
        let value = if self.log { value.log10() } else { value };
        (value - self.low) / (self.high - self.low)
    }

    fn linear(&mut self, most: usize) {
        let values = ticks(self.low, self.high, most);
        self.ticks = values.iter().copied().zip(labels(&values)).collect();
    }

    fn logarithmic(&mut self, most: usize) {
        let (first, last) = ((self.low - 1e-9).ceil() as i32, (self.high + 1e-9).floor() as i32);
        let inside = |value: f64| (self.low - 1e-9..=self.high + 1e-9).contains(&value.log10());
        let decades = |multiples: &'static [f64]| {
            let powers = (first - 1)..=last;
            powers.flat_map(|power| multiples.iter().map(move |m| (m * 10f64.powi(power), power, *m)))
        };
        if last - first >= 2 {
            let stride = ((last - first) as usize).div_ceil(most.max(2)).max(1);
            let powers = (first..=last).step_by(stride);
            let plain = first >= -3 && last <= 3;
            self.ticks = powers.map(|power| (10f64.powi(power), power_label(1.0, power, plain))).collect();
            self.minor = if stride == 1 {
                decades(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0])
                    .map(|tick| tick.0)
                    .filter(|v| inside(*v))
                    .collect()
            } else {
                (first..=last).map(|power| 10f64.powi(power)).collect()
            };
            return;
        }
        let few = decades(&[1.0, 2.0, 5.0]).filter(|tick| inside(tick.0));
        let plain = first >= -3 && last <= 3;
        self.ticks =
            few.map(|(value, power, multiple)| (value, power_label(multiple, power, plain))).collect();
        self.minor = decades(&[3.0, 4.0, 6.0, 7.0, 8.0, 9.0])
            .map(|tick| tick.0)
            .filter(|value| inside(*value))
            .collect();
        if self.ticks.len() < 2 {
            // less than a factor of two or so: equidistant values tell more
            self.minor.clear();
            let values = ticks(10f64.powf(self.low), 10f64.powf(self.high), most);
            self.ticks = values.iter().copied().zip(labels(&values)).collect();
        }
    }
}

/// `multiple`·10^`power`, as a plain number or in powers of ten.
fn power_label(multiple: f64, power: i32, plain: bool) -> String {
    let value = multiple * 10f64.powi(power);
    if plain { format!("{value:.*}", (-power).max(0) as usize) } else { number(value, power, 0) }
}

/// Tick positions at 1, 2 or 5 times a power of ten inside `[low, high]`, at most `most` + 1 of them.
pub(super) fn ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return vec![low];
    }
    let power = 10f64.powf((span / most.max(2) as f64).log10().floor());
    // first and last multiple of a step inside, but for rounding
    let ends = |step: f64| [(low / step - 1e-9).ceil(), (high / step + 1e-9).floor()];
    let fits = |step: &f64| {
        let [first, last] = ends(*step);
        last - first <= most as f64
    };
    let step = [1.0, 2.0, 5.0, 10.0, 20.0].map(|factor| factor * power).into_iter().find(fits);
    let step = step.unwrap_or(span);
    let [first, last] = ends(step);
    // bounded, since beyond 2⁵³ adding one changes nothing
    let indices = std::iter::successors(Some(first), |index| (*index < last).then_some(index + 1.0));
    indices.take(most + 1).map(|index| index * step).collect()
}

/// Labels for equidistant ticks: as many digits as tell them apart, powers of ten outside 1e-3 … 1e5.
pub(super) fn labels(ticks: &[f64]) -> Vec<String> {
    let largest = ticks.iter().fold(0.0f64, |size, tick| size.max(tick.abs()));
    let step = ticks.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let step = if step.is_finite() && step > 0.0 { step } else { largest };
    let order = |value: f64| (value * (1.0 + 1e-9)).log10().floor() as i32;
    let plain = largest == 0.0 || (-3..5).contains(&order(largest));
    let label = |tick: &f64| {
        if step == 0.0 || (!plain && tick.abs() < 1e-6 * step) {
            return "0".to_owned();
        }
        let power = if plain { 0 } else { order(tick.abs()) };
        number(*tick, power, (power - order(step)).clamp(0, 17) as usize)
    };
    ticks.iter().map(label).collect()
}

/// `−1.5×10⁻³`: `value` in powers of ten with `digits` decimals.
fn number(value: f64, power: i32, digits: usize) -> String {
    let mantissa = format!("{:.digits$}", value / 10f64.powi(power));
    // no "-0.0"
    let zero = mantissa.chars().all(|c| matches!(c, '-' | '0' | '.'));
    let mantissa = if zero { mantissa.replace('-', "") } else { mantissa.replace('-', "−") };
    if power == 0 {
        return mantissa;
    }
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| SUPERSCRIPTS[digit as usize]);
    let exponent: String = power.to_string().chars().map(raised).collect();
    if mantissa == "1" { format!("10{exponent}") } else { format!("{mantissa}×10{exponent}") }
}

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
