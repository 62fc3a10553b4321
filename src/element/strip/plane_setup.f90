!> Does a patch do as one in plane strain?
module plane_setup
  use kinds, only: wp
  use block_law, only: block_law_t
  use strain_projection, only: project_nothing
  use ig_patch, only: ig_patch_t
  use plane_dispatch, only: plane_kernel_of
  implicit none
  private

  public :: set_plane_strain

contains

  !> Let a patch, whose motion along a coordinate is held everywhere and whose sides are loaded
  !! alike, work in the plane. Nothing changes where it is not one element wide across that
  !! coordinate, linear with one point, or where material or state could move the sides apart.
  pure subroutine set_plane_strain(patch, law, component, x)
    type(ig_patch_t), intent(inout) :: patch
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: component         !! that is held: 1 x, 2 y, 3 z
    real(wp), intent(in) :: x(:, :, :, :)    !! control points
    integer, parameter :: in_plane(4, 3) = reshape([2, 3, 1, 6, 1, 3, 2, 5, 1, 2, 3, 4], [4, 3])
    real(wp) :: width
    integer :: i

    associate (places => in_plane(:, component), across => patch%axes(2))
      if (any([across%degree, across%n_elements, across%n_points] /= 1)) return
      if (patch%is_rational .or. patch%projection%kind /= project_nothing) return
      if (law%needs_context .or. .not. law%keeps_plane(component)) return
      do i = 1, size(patch%state, 3)
        if (i /= law%eqps_state .and. any(abs(patch%state(:, :, i, :, :)) > 0.0_wp)) return
      end do
      if (any(abs(x(:, 2, :, places(:2)) - x(:, 1, :, places(:2))) > 0.0_wp)) return
      width = x(1, 2, 1, component) - x(1, 1, 1, component)
      if (any(abs(x(:, 2, :, component) - x(:, 1, :, component) - width) &
              > 1.0e-9_wp*abs(width))) return
      patch%plane%places = places
      patch%plane%across = 0.5_wp*width
      patch%plane%half = merge(0.5_wp, -0.5_wp, component == 2)*width
    end associate
    allocate (patch%plane%sides(size(patch%tiles)))
    do i = 1, size(patch%tiles)
      associate (tile => patch%tiles(i))
        allocate (patch%plane%sides(i)%force(tile%control_first(1):tile%control_last(1), 1, &
                                             patch%n_control(3), 3))
      end associate
    end do
    patch%plane%kernel = plane_kernel_of(patch%axes%degree, patch%axes%n_points)
  end subroutine set_plane_strain

end module plane_setup
