//! The peers, each wrapped in one file.

mod bvh;
mod embree;
mod obvhs;
mod parry;

pub use self::bvh::{BvhBuilder, BvhPeer};
pub use self::obvhs::{ObvhsBuilder, ObvhsPeer};
pub use embree::{Call, Embree, EmbreeBuilder, EmbreeEngine, EmbreeScene, Quality};
pub use parry::{ParryBuilder, ParryPeer};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::{Answers, Engine, Oracle, Testimony, verify};
    use crate::own::TaB;
    use crate::scene::Mesh;
    use crate::workload::{Kind, Random, Workload};
    use ropewalk::Ray;

    fn soup(faces: u32) -> Mesh {
        let mut random = Random::new(21);
        let mut mesh = Mesh { name: "soup".into(), ..Mesh::default() };
        for face in 0..faces {
            let center: [f64; 3] = std::array::from_fn(|_| random.unit());
            for _ in 0..3 {
                let d = random.direction();
                mesh.vertices.push(std::array::from_fn(|a| (center[a] + 0.15 * d[a]) as f32));
            }
            mesh.faces.push([3 * face, 3 * face + 1, 3 * face + 2]);
        }
        mesh
    }

    /// Embree's library is not there in every checkout; the benchmark itself verifies it.
    #[test]
    fn crates_and_the_own_path_answer_every_question_as_the_oracle_does() {
        let mesh = soup(400);
        let engines: [Box<dyn Engine>; 4] = [
            Box::new(ObvhsPeer::build(&mesh)),
            Box::new(BvhPeer::build(&mesh)),
            Box::new(ParryPeer::build(&mesh).unwrap()),
            Box::new(TaB::build(&mesh, 1).unwrap()),
        ];
        let mut random = Random::new(22);
        let mut ray = || {
            let origin = std::array::from_fn(|_| random.unit() as f32);
            let dir = random.direction().map(|x| x as f32);
            Ray::new(origin, dir).with_range(0.0, 0.3 + random.unit() as f32)
        };
        let rays: Vec<Ray> = (0..2000).map(|_| ray()).collect();
        for kind in [Kind::Primary, Kind::Shadow, Kind::AllHits, Kind::FirstHits, Kind::Walk1] {
            let work = Workload { kind, rays: rays.clone(), chains: vec![0] };
            let answers: Vec<Answers> = engines
                .iter()
                .map(|engine| {
                    let mut answers = Answers::for_workload(&work);
                    answers.fill(&**engine, &work);
                    answers
                })
                .collect();
            let testimonies: Vec<Testimony> =
                answers.iter().map(|answers| Testimony { answers, stride: 1 }).collect();
            let verdicts = verify(&Oracle::new(&mesh), 400, &work, &testimonies);
            for (engine, verdict) in engines.iter().zip(verdicts) {
                let wrong = verdict.wrong_per_million;
                assert_eq!(wrong, 0.0, "{} on {}", engine.name(), kind.name());
            }
        }
    }
}
