!> The exact geometry of blank and tools in a results file, under /nurbs.
module nurbs_record
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: to_text
  use knot_vector, only: knot_vector_t
  use nurbs_solid, only: nurbs_solid_t
  use nurbs_surface, only: nurbs_surface_t
  use hdf5_file, only: hdf5_file_t, integer_values, write_integers, write_reals
  implicit none
  private

  public :: write_solid, write_surface, update_points

contains

  !> Write a solid: degrees, knots, weights and control points.
  subroutine write_solid(file, folder, solid, length_unit)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder, length_unit
    type(nurbs_solid_t), intent(in) :: solid
    integer :: n(4)

    n = shape(solid%points)
    call write_axes(file, folder, solid%axes)
    call write_reals(file, folder//"/weights", solid%weights, n(:3), "1", &
                     "weights of the control points, indices (zeta, eta, xi)")
    call update_points(file, folder, reshape(solid%points, [product(n(:3)), 3]), n(:3), &
                       length_unit)
  end subroutine write_solid

  !> Write a surface: degrees, knots, weights and control points.
  subroutine write_surface(file, folder, surface, length_unit)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder, length_unit
    type(nurbs_surface_t), intent(in) :: surface
    integer :: n(3)

    n = shape(surface%points)
    call write_axes(file, folder, surface%axes)
    call write_reals(file, folder//"/weights", surface%weights, n(:2), "1", &
                     "weights of the control points, indices (eta, xi)")
    call update_points(file, folder, reshape(surface%points, [product(n(:2)), 3]), n(:2), &
                       length_unit)
  end subroutine write_surface

  !> Write control points, or overwrite them with those of a later time.
  subroutine update_points(file, folder, points, grid, length_unit)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder, length_unit
    real(wp), intent(in) :: points(:, :)   !! shape (product(grid), 3)
    integer, intent(in) :: grid(:)         !! control points per direction

    call write_reals(file, folder//"/points", transpose(points), [3, grid], length_unit, &
                     "control points of the last frame, not multiplied by their weights, " &
                     //"last axis first, components last")
  end subroutine update_points

  subroutine write_axes(file, folder, axes)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: folder
    type(knot_vector_t), intent(in) :: axes(:)
    integer :: d

    call write_integers(file, folder//"/degrees", int(axes%degree, int64), [size(axes)], &
                        "polynomial degrees", integer_values)
    do d = 1, size(axes)
      call write_reals(file, folder//"/knots_"//to_text(d), axes(d)%knots, &
                       [size(axes(d)%knots)], "1", "knot vector of axis "//to_text(d))
    end do
  end subroutine write_axes

end module nurbs_record
