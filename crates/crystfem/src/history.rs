//! Temperature histories: ramps and holds, or a table.

use crate::error::Error;

/// A piecewise linear temperature history.
#[derive(Clone, Debug, PartialEq)]
pub struct TemperatureHistory {
    /// Times, s; equal neighbours mark a jump.
    times: Vec<f64>,
    /// Temperatures, K.
    temperatures: Vec<f64>,
}

/// A leg of a history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leg {
    /// Ramp to a temperature, K, at a rate, K/s.
    Rate {
        /// Final temperature, K.
        to: f64,
        /// Rate, K/s, above 0 for heating and cooling alike.
        rate: f64,
    },
    /// Ramp to a temperature, K, in a time, s; 0 is a jump.
    Time {
        /// Final temperature, K.
        to: f64,
        /// Duration, s.
        duration: f64,
    },
    /// Hold at the same temperature, s.
    Hold {
        /// Duration, s.
        duration: f64,
    },
}

/// A linear segment of a history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistorySegment {
    /// Times, s.
    pub times: [f64; 2],
    /// Temperatures, K.
    pub temperatures: [f64; 2],
}

impl HistorySegment {
    /// Interpolates the temperature at a time within the segment, K.
    pub fn temperature_at(&self, time: f64) -> f64 {
        let [from, to] = self.temperatures;
        let duration = self.times[1] - self.times[0];
        if time >= self.times[1] || duration == 0.0 {
            return to;
        }
        from + (to - from) * ((time - self.times[0]) / duration)
    }
}

impl TemperatureHistory {
    /// Returns a history through points.
    ///
    /// # Errors
    /// [`Error::Parameter`] for no points, columns of different lengths, times that decrease, temperatures
    /// below 0 K, and values that are not finite.
    pub fn new(times: Vec<f64>, temperatures: Vec<f64>) -> Result<Self, Error> {
        let refuse = |name, found, allowed: String| Err(Error::Parameter { name, found, allowed });
        if times.is_empty() || times.len() != temperatures.len() {
            let allowed = format!("{}, one for each time, at least one", times.len());
            return refuse("temperatures of a history", temperatures.len() as f64, allowed);
        }
        for (index, &time) in times.iter().enumerate() {
            let before = if index > 0 { times[index - 1] } else { f64::NEG_INFINITY };
            if !(time >= before && time.is_finite()) {
                return refuse("time of a history, s", time, format!("{before} or later, finite"));
            }
        }
        if let Some(&bad) = temperatures.iter().find(|t| !(**t >= 0.0 && t.is_finite())) {
            return refuse("temperature of a history, K", bad, "0 or above, finite".into());
        }
        Ok(Self { times, temperatures })
    }

    /// Builds a history of legs from time 0 and a temperature, K.
    ///
    /// # Errors
    /// [`Error::Parameter`] for rates that are not above 0, durations below 0, and as for
    /// [`TemperatureHistory::new`].
    pub fn from_legs(start: f64, legs: &[Leg]) -> Result<Self, Error> {
        let (mut times, mut temperatures) = (vec![0.0], vec![start]);
        let (mut time, mut temperature) = (0.0, start);
        for leg in legs {
            let (to, duration) = match *leg {
                Leg::Rate { to, rate } => {
                    if !(rate > 0.0 && rate.is_finite()) {
                        let allowed = "above 0, for heating and cooling alike".to_owned();
                        return Err(Error::Parameter { name: "rate of a ramp, K/s", found: rate, allowed });
                    }
                    (to, (to - temperature).abs() / rate)
                }
                Leg::Time { to, duration } => (to, duration),
                Leg::Hold { duration } => (temperature, duration),
            };
            if !(duration >= 0.0 && duration.is_finite()) {
                let allowed = "0 or above, finite".to_owned();
                return Err(Error::Parameter { name: "duration of a leg, s", found: duration, allowed });
            }
            (time, temperature) = (time + duration, to);
            times.push(time);
            temperatures.push(temperature);
        }
        Self::new(times, temperatures)
    }

    /// Reads a CSV file with the columns `time [unit]` and `temperature [unit]`.
    ///
    /// # Errors
    /// [`Error::File`] as for `table::read`, and for times that decrease.
    pub fn read(path: &std::path::Path) -> Result<Self, Error> {
        use crate::table::{TableColumn, read_with_lines};
        use polycore::units::dimension::{TemperatureDimension, TimeDimension};

        let columns = [
            TableColumn::new::<TimeDimension>("time"),
            TableColumn::new::<TemperatureDimension>("temperature"),
        ];
        let ([times, temperatures], lines) = read_with_lines(path, columns)?;
        if let Some(row) = (1..times.len()).find(|&row| times[row] < times[row - 1]) {
            return Err(Error::File {
                path: path.to_path_buf(),
                line: lines[row],
                what: "time".to_owned(),
                found: format!("{} s", times[row]),
                allowed: format!("{} s or later, as in the previous row", times[row - 1]),
            });
        }
        Self::new(times, temperatures)
    }

    /// Initial temperature, K.
    pub fn start(&self) -> f64 {
        self.temperatures[0]
    }

    /// First and last time, s.
    pub fn span(&self) -> [f64; 2] {
        [self.times[0], self.times[self.times.len() - 1]]
    }

    /// Segments, jumps included.
    pub fn segments(&self) -> impl Iterator<Item = HistorySegment> + '_ {
        (1..self.times.len()).map(|i| HistorySegment {
            times: [self.times[i - 1], self.times[i]],
            temperatures: [self.temperatures[i - 1], self.temperatures[i]],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs() {
        let legs = [
            Leg::Rate { to: 390.0, rate: 0.5 },
            Leg::Hold { duration: 60.0 },
            Leg::Time { to: 450.0, duration: 0.0 },
            Leg::Time { to: 400.0, duration: 100.0 },
        ];
        let history = TemperatureHistory::from_legs(470.0, &legs).unwrap();
        assert_eq!((history.start(), history.span()), (470.0, [0.0, 320.0]));
        let segments: Vec<HistorySegment> = history.segments().collect();
        assert_eq!(segments[0].temperature_at(80.0), 430.0);
        assert_eq!(
            (
                segments[2].temperature_at(220.0),
                segments[3].temperature_at(320.0),
                segments[3].temperature_at(400.0)
            ),
            (450.0, 400.0, 400.0)
        );
    }

    #[test]
    fn refusals() {
        let message = |legs: &[Leg]| TemperatureHistory::from_legs(400.0, legs).unwrap_err().to_string();
        assert!(message(&[Leg::Rate { to: 300.0, rate: -1.0 }]).contains("found -1; allowed: above 0"));
        assert!(message(&[Leg::Rate { to: 300.0, rate: 1e-320 }]).contains("found inf"));
        assert!(message(&[Leg::Hold { duration: f64::NAN }]).contains("found NaN"));
        assert!(message(&[Leg::Time { to: -1.0, duration: 1.0 }]).contains("found -1; allowed: 0 or above"));
        assert!(TemperatureHistory::new(vec![], vec![]).is_err());
        assert!(
            TemperatureHistory::new(vec![1.0, 0.0], vec![300.0, 300.0])
                .unwrap_err()
                .to_string()
                .contains("1 or later")
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("h.csv");
        std::fs::write(&path, "time [s],temperature [degC]\n0,20\n10,30\n5,40\n").unwrap();
        let error = TemperatureHistory::read(&path).unwrap_err().to_string();
        assert!(error.contains("h.csv:4: time: found \"5 s\"; allowed: 10 s or later"), "{error}");
        std::fs::write(&path, "time [min],temperature [degC]\n0,20\n10,30\n").unwrap();
        assert_eq!(TemperatureHistory::read(&path).unwrap().span(), [0.0, 600.0]);
    }
}
