!> The lowest frequencies of a body of any size without stress.
module body_modes
  use, intrinsic :: iso_c_binding, only: c_funptr
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use patch_seams, only: seams_t
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use element, only: part_t
  use vibration, only: fixed_t, free_frequencies, trial_amount
  use shell_joints, only: shell_joints_t
  use body_parts, only: elastic_copies
  use unknowns, only: to_unknowns, unknowns_t
  use mumps_library, only: find_mumps
  use eigenpairs, only: block_size, find_eigenpairs
  use body_stiffness, only: bending_guess, body_stiffness_t, add_stiffness, find_unknowns, &
                            masses_of, new_body_stiffness
  implicit none
  private

  public :: find_frequencies, lowest_frequencies

  integer, parameter :: max_dense = 5000         !! unknowns; the matrix takes 0.2 GB, its
                                                 !! eigenvalues minutes
  integer, parameter :: least_sparse = 300       !! unknowns from which factors are quicker

contains

  !> Angular frequencies [1/time] in rising order: all of a small body, or the lowest `n`. Fails
  !! where the body is large and there is no MUMPS.
  subroutine find_frequencies(bodies, seams, law, fixed, joints, n, omega, error)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    type(fixed_t), intent(in) :: fixed(:)            !! by part
    type(shell_joints_t), intent(in) :: joints
    integer, intent(in) :: n
    real(wp), allocatable, intent(out) :: omega(:)
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: without
    type(unknowns_t) :: map
    type(c_funptr) :: entry
    logical :: is_coupled
    integer :: p

    call find_unknowns(bodies, seams, fixed, map, error)
    if (allocated(error)) return
    call find_mumps(entry, without)
    is_coupled = .false.
    do p = 1, size(bodies)
      is_coupled = is_coupled .or. bodies(p)%element%is_coupled
    end do
    if (.not. (allocated(without) .or. is_coupled) &
        .and. map%n_free > max(least_sparse, 4*block_size(n))) then
      call lowest_frequencies(bodies, seams, law, fixed, joints, n, omega, error)
    else if (map%n_free <= max_dense) then
      omega = free_frequencies(bodies, seams, law, fixed, joints)
    else if (is_coupled) then
      call refuse(map%n_free, "with a smooth projection", error)
    else if (allocated(without)) then
      call refuse(map%n_free, "in a program built without MUMPS", error)
    else
      call fail(error, "--modes finds at most "//to_text(((map%n_free - 1)/4 - 8)/2)// &
                " frequencies of a blank with "//to_text(map%n_free)//" free components, not "// &
                to_text(n))
    end if
  end subroutine find_frequencies

  subroutine refuse(n_free, why, error)
    integer, intent(in) :: n_free
    character(*), intent(in) :: why
    type(error_t), allocatable, intent(out) :: error

    call fail(error, "--modes works on at most "//to_text(max_dense)//" free components of "// &
              "control points "//why//"; this blank has "//to_text(n_free))
  end subroutine refuse

  !> The lowest angular frequencies [1/time] by MUMPS. Rigid motions give zero up to round-off.
  subroutine lowest_frequencies(bodies, seams, law, fixed, joints, n, omega, error)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    type(fixed_t), intent(in) :: fixed(:)            !! by part
    type(shell_joints_t), intent(in) :: joints
    integer, intent(in) :: n                         !! wanted
    real(wp), allocatable, intent(out) :: omega(:)
    type(error_t), allocatable, intent(out) :: error
    type(part_t), allocatable :: trial(:)
    type(shell_joints_t) :: springs
    type(body_stiffness_t) :: stiffness
    real(wp), allocatable :: mass(:), values(:), vectors(:, :)

    call new_body_stiffness(stiffness, bodies, seams, fixed, error, joints)
    if (allocated(error)) return
    trial = elastic_copies(bodies)
    springs = joints
    call add_stiffness(stiffness, trial, &
                        elastic_t(density=law%density, bulk=law%bulk, shear=law%shear), 1.0_wp, &
                        trial_amount(bodies), springs)
    mass = to_unknowns(stiffness%map, masses_of(bodies))
    call find_eigenpairs(stiffness%matrix, mass, bending_guess(bodies, law), n, values, vectors, &
                         error)
    if (.not. allocated(error)) omega = sqrt(max(0.0_wp, values))
  end subroutine lowest_frequencies

end module body_modes
