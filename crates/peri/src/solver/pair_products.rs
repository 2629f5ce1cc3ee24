//! Inner products of the pairs of L-BFGS, and the recursion carried out on them, see [`super::lbfgs_memory`].

use std::collections::VecDeque;

/// Inner products of a pair.
struct OnePair {
    /// s·y and y·w of this pair.
    curvature: f64,
    size: f64,
    /// s·y and w·y with the y of each later pair, in their order.
    later: VecDeque<[f64; 2]>,
    /// s·g and w·g with the present gradient.
    gradient: [f64; 2],
}

/// Inner products of all pairs, oldest first.
pub struct PairProducts {
    most: usize,
    pairs: VecDeque<OnePair>,
    /// Scale of the initial inverse; 1 until a pair is known.
    scale: f64,
}

/// Fate of a new pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// It has no curvature, or there is no room for any.
    None,
    /// It is the newest.
    Newest,
    /// It is the newest, and the oldest is forgotten.
    InsteadOfOldest,
}

impl PairProducts {
    /// Creates a list for `most` pairs.
    pub fn new(most: usize) -> Self {
        Self { most, pairs: VecDeque::new(), scale: 1.0 }
    }

    /// Scale γ of the initial inverse.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Forgets all pairs, and the scale if it belongs to another preconditioner.
    pub fn clear(&mut self, scale_too: bool) {
        self.pairs.clear();
        if scale_too {
            self.scale = 1.0;
        }
    }

    /// Weights a and b of each pair in the direction −γ B g + Σ_i (γ a_i w_i − b_i s_i).
    pub fn weights(&self) -> (Vec<f64>, Vec<f64>) {
        let count = self.pairs.len();
        // backwards: a_i = s_i·(g − Σ_{j>i} a_j y_j)/(s_i·y_i)
        let mut back = vec![0.0; count];
        for i in (0..count).rev() {
            let pair = &self.pairs[i];
            let later: f64 = (i + 1..count).map(|j| back[j] * pair.later[j - i - 1][0]).sum();
            back[i] = (pair.gradient[0] - later) / pair.curvature;
        }
        // forwards: b_i = y_i·(γ(z − Σ_j a_j w_j) + Σ_{k<i} (a_k − b_k) s_k)/(s_i·y_i)
        let mut weights = vec![0.0; count];
        for i in 0..count {
            let pair = &self.pairs[i];
            let mut value = pair.gradient[1] - back[i] * pair.size;
            for j in 0..count {
                if j < i {
                    value -= back[j] * self.pairs[j].later[i - j - 1][1];
                } else if j > i {
                    value -= back[j] * pair.later[j - i - 1][1];
                }
            }
            value *= self.scale;
            for (k, weight) in weights[..i].iter().enumerate() {
                value += weight * self.pairs[k].later[i - k - 1][0];
            }
            weights[i] = back[i] - value / pair.curvature;
        }
        (back, weights)
    }

    /// Adds a pair with its s·y, w·y, s·g, w·g, unless s·y is at most `least`; `others` are s·y, w·y, s·g,
    /// w·g of each other pair with the new y and g.
    pub fn add(&mut self, own: [f64; 4], others: &[[f64; 4]], least: f64) -> Kept {
        let [curvature, size, step_slope, image_slope] = own;
        let keep = curvature > least && size > 0.0 && curvature.is_finite() && size.is_finite();
        for (pair, sums) in self.pairs.iter_mut().zip(others) {
            pair.gradient = [sums[2], sums[3]];
            if keep {
                pair.later.push_back([sums[0], sums[1]]);
            }
        }
        if !keep || self.most == 0 {
            return Kept::None;
        }
        self.scale = curvature / size;
        let full = self.pairs.len() == self.most;
        if full {
            self.pairs.pop_front();
        }
        let gradient = [step_slope, image_slope];
        self.pairs.push_back(OnePair { curvature, size, later: VecDeque::new(), gradient });
        if full { Kept::InsteadOfOldest } else { Kept::Newest }
    }
}
