//! Shading normals that keep the scene's promise of unit length.

use crate::scene::Mesh;
use glam::Vec3;

/// Makes the normals of a mesh unit vectors. One without a direction is replaced by the mean of
/// the triangles around it.
pub(super) fn make_unit(mesh: &mut Mesh) {
    let mut lost = false;
    for normal in &mut mesh.normals {
        // Scaled first, so that squares neither overflow nor vanish.
        let scaled = *normal / normal.abs().max_element();
        *normal = scaled.normalize_or_zero();
        lost |= *normal == Vec3::ZERO;
    }
    if !lost {
        return;
    }
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        triangle.iter().for_each(|&corner| sums[corner as usize] += normal);
    }
    for (normal, sum) in mesh.normals.iter_mut().zip(sums) {
        if *normal == Vec3::ZERO {
            *normal = sum.try_normalize().unwrap_or(Vec3::Y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_become_unit_vectors() {
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            normals: vec![Vec3::ZERO, Vec3::splat(1e30), Vec3::splat(-1e-40), Vec3::ZERO],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        make_unit(&mut mesh);
        assert_eq!(mesh.normals[0], Vec3::Z, "the triangle's");
        assert_eq!(mesh.normals[3], Vec3::Y, "no triangle's");
        assert!(mesh.normals.iter().all(|normal| normal.is_normalized()));
    }
}
