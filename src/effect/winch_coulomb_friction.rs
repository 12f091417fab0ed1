//! Coulomb friction in the winch: F_c tanh(l̇/v_s) added to the pull felt by the cable when paying out.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use super::presliding::{self, Presliding, in_direction, turned};
use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::{Real, tanh};

/// Coulomb friction in the winch: F_c tanh(l̇/v_s) added to the pull felt by the cable when paying out.
///
/// No smooth law is the true one, so the shape can be fitted: a share w of the force turns its sign as
/// (2/π) arctan(π l̇/(2 v_s)) and a share b as l̇/√(l̇² + v_s²), as steep at rest and slower to reach F_c. Both are 0 by
/// default. Drives differ in their two directions: with an asymmetry a the force is F_c (1 + a) when paying out and
/// F_c (1 - a) when winding in. With a presliding stiffness σ₀ the friction gives like a spring before it slides, and holds for
/// ever what does not make it slide: it keeps a deflection z (m) on each winch as its state, ż = l̇ - σ₀ z |l̇|/g with
/// g = F_c (1 ± a) in each direction, and pulls with σ₀ z + σ₁ exp(-(l̇/v_d)²) ż (LuGre; Dahl's model where σ₁ = 0). Then
/// the bristle makes the turn, and transition_speed, tail and algebraic do nothing.
///
/// Shows in: tension against winch force, with the sign of the winch speed.
///
/// Valid for: sliding, with presliding rest and small motions too; the smooth law creeps at speeds below v_s where a real winch sticks.
///
/// Source: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, A survey of models for friction, Automatica 30 (1994); presliding: P. R. Dahl, A solid friction model (1968); C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, A new model for control of systems with friction, IEEE Trans. Automatic Control 40 (1995).
#[derive(Clone, Debug)]
pub struct WinchCoulombFriction {
    force: f64,
    transition_speed: f64,
    tail: f64,
    algebraic: f64,
    asymmetry: f64,
    presliding: Option<Presliding>,
}

/// The law with numbers: the shapes in which the force turns its sign, each with its part of the force.
fn law(values: &[f64], number: &dyn Fn(f64) -> String) -> String {
    let [force, speed, tail, algebraic] = values[..4] else {
        unreachable!("the values of a spec are as many as the parameters")
    };
    let v = number(speed);
    let shapes = [
        (1.0 - tail - algebraic, format!("tanh(l̇/{v})")),
        (tail, format!("(2/π) arctan(π/2 l̇/{v})")),
        (algebraic, format!("l̇/√(l̇² + {v}²)")),
    ];
    if let Some([pull, deflection]) = presliding::law(values, number) {
        return format!("{pull}, {deflection}, F = {}", presliding::level(&number(force), values, number));
    }
    let shapes: Vec<(f64, String)> = shapes.into_iter().filter(|(share, _)| *share != 0.0).collect();
    if let [(_, shape)] = &shapes[..] {
        return presliding::sliding([&number(force), shape, ""], values, number);
    }
    let sum = |scale: f64| {
        let mut sum = String::new();
        for (share, shape) in &shapes {
            let sign = match (*share < 0.0, sum.is_empty()) {
                (false, true) => "",
                (false, false) => " + ",
                (true, true) => "-",
                (true, false) => " - ",
            };
            sum.push_str(&format!("{sign}{} {shape}", number((share * scale).abs())));
        }
        sum
    };
    match values.last() {
        Some(asymmetry) if *asymmetry != 0.0 => presliding::sliding([&number(force), &sum(1.0), ""], values, number),
        _ => format!("F = {}", sum(force)),
    }
}

impl WinchCoulombFriction {
    /// The smooth sign of a speed relative to the transition speed.
    #[inline]
    fn sign<S: Real>(&self, speed: S) -> S {
        let sign = tanh(speed);
        if self.tail == 0.0 && self.algebraic == 0.0 {
            return sign;
        }
        let slow = (speed * FRAC_PI_2).atan() * FRAC_2_PI;
        let root = speed * (speed * speed + 1.0).sqrt().recip();
        sign * (1.0 - self.tail - self.algebraic) + slow * self.tail + root * self.algebraic
    }
}

impl Effect for WinchCoulombFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_coulomb_friction",
        title: "Coulomb friction in the winch",
        equation: "F_c tanh(l̇/v_s) added to the pull felt by the cable when paying out (with shares w and b: F_c s, s = (1 - w - b) tanh(l̇/v_s) + w (2/π) arctan(π l̇/(2 v_s)) + b l̇/√(l̇² + v_s²); with asymmetry: F_c s (1 + a s); with presliding: σ₀ z + σ₁ exp(-(l̇/v_d)²) ż, ż = l̇ - σ₀ z |l̇|/g, g = F_c (1 ± a))",
        law,
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Direction],
        parameters: &[
            parameter("force", "N", "friction force F_c", (5.0, 2e3)).at_least(0.0),
            parameter("transition_speed", "m/s", "speed v_s over which the force turns its sign", (1e-4, 0.1)).at_least(1e-9).or(0.01).shape().idle_beside("presliding_stiffness"),
            parameter("tail", "1", "share w of the force that turns as (2/π) arctan(π l̇/(2 v_s)) in place of tanh", (-0.2, 1.0))
                .at_least(-0.5)
                .at_most(1.5)
                .or(0.0)
                .shape().idle_beside("presliding_stiffness")
                .extension(),
            parameter("algebraic", "1", "share b of the force that turns as l̇/√(l̇² + v_s²) in place of tanh", (-0.2, 1.0))
                .at_least(-0.5)
                .at_most(1.5)
                .or(0.0)
                .shape().idle_beside("presliding_stiffness")
                .extension(),
            presliding::PARAMETERS[0],
            presliding::PARAMETERS[1],
            presliding::PARAMETERS[2],
            presliding::PARAMETERS[3],
        ],
        texts: &[],
        shows_in: "tension against winch force, with the sign of the winch speed",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, A survey of models for friction, Automatica 30 (1994); presliding: P. R. Dahl, A solid friction model (1968); C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, A new model for control of systems with friction, IEEE Trans. Automatic Control 40 (1995)",
        validity: "sliding, with presliding rest and small motions too; the smooth law creeps at speeds below v_s where a real winch sticks",
        look_alikes: &[
            LookAlike { id: "pulley_capstan_loss", separate_by: "change the pretension" },
            LookAlike { id: "winch_stribeck_friction", separate_by: "slow and fast reversals" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let [force, transition_speed, tail, algebraic] = spec.values[..4] else {
            unreachable!("the values of a spec are as many as the parameters")
        };
        let asymmetry = spec.values[spec.values.len() - 1];
        let presliding = Presliding::new(spec, [force, force])?;
        Ok(Self { force, transition_speed, tail, algebraic, asymmetry, presliding })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, _force: S, context: &WinchContext<S>) -> S {
        turned(self.sign(context.speed / self.transition_speed), self.asymmetry) * self.force
    }

    fn states(&self) -> usize {
        usize::from(self.presliding.is_some())
    }

    fn loss_in<S: Real>(&self, force: S, states: &[S], rates: &mut [S], context: &WinchContext<S>) -> S {
        let Some(presliding) = &self.presliding else { return self.loss(force, context) };
        let level = S::from(self.force * in_direction(context.speed, self.asymmetry));
        presliding.pull(context.speed, level, states[0], &mut rates[0])
    }

    fn loss_state_size(&self) -> f64 {
        self.presliding.as_ref().map_or(1.0, |p| p.size(self.force))
    }
}
