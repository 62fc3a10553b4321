!> Memory that a patch holds, over what its state alone needs.
module memory_cost
  use kinds, only: wp
  use ig_patch, only: ig_patch_t, tile_buffer_t
  implicit none
  private

  public :: memory_ratio

contains

  !> All arrays of a patch with its motion over stress and state of its points and positions and
  !! velocities of its control points. Lanes that fill the last block up count as held.
  pure real(wp) function memory_ratio(patch, buffers, n_components) result(ratio)
    type(ig_patch_t), intent(in) :: patch
    type(tile_buffer_t), intent(in) :: buffers(:)
    integer, intent(in) :: n_components   !! of the control points, three for each
    integer :: n_points, i
    real(wp) :: needed, held

    n_points = product(patch%axes%n_points*patch%axes%n_elements)
    needed = real(n_points, wp)*(6 + size(patch%state, 3)) + 2.0_wp*n_components
    held = size(patch%stress) + size(patch%state) + size(patch%push)
    if (allocated(patch%weights)) held = held + size(patch%weights)
    if (allocated(patch%rational)) held = held + size(patch%rational)
    if (allocated(patch%reference)) held = held + size(patch%reference)
    if (allocated(patch%element_size)) held = held + size(patch%element_size)
    if (allocated(patch%viscosity%length)) held = held + size(patch%viscosity%length)
    held = held + size(patch%lanes%values) + size(patch%lanes%slopes) + size(patch%lanes%weights)
    do i = 1, 3
      held = held + size(patch%axes(i)%values) + size(patch%axes(i)%slopes)
    end do
    do i = 1, size(buffers)
      held = held + size(buffers(i)%force)
    end do
    ! Positions, velocities, forces within and from outside; mass and inertia once for each point.
    held = held + (4 + 2.0_wp/3)*n_components
    ratio = held/needed
  end function memory_ratio

end module memory_cost
