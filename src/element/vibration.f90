!> Free vibration of a body about its stress-free shape.
module vibration
  use kinds, only: wp
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use patch_seams, only: seams_t, is_counted, collect, sum_groups, distribute
  use element, only: part_t, force_report_t
  use shell_joints, only: shell_joints_t
  use body_parts, only: lead_edges, forces_of_parts, elastic_copies
  use outline_ties, only: outline_ties_t
  use linear_algebra, only: eigenvalues
  implicit none
  private

  public :: fixed_t, free_frequencies, trial_amount

  !> Components of the control points of a patch that stay.
  type :: fixed_t
    logical, allocatable :: is_fixed(:, :, :, :)   !! shape (n1, n2, n3, 3)
    !> Where some move alike: place of the first of these in the field as one list, its own for
    !! others; shape (3*n1*n2*n3).
    integer, allocatable :: leader(:)
  end type fixed_t

  !> Components that move alike, of one part: their places in its field as one list.
  type :: freedom_t
    integer :: part = 0
    integer, allocatable :: places(:)
  end type freedom_t

contains

  !> Angular frequencies [1/time] in rising order, one for each component of a control point that
  !! is not fixed: roots of the eigenvalues of M^-1/2 K M^-1/2, made dense by one force evaluation
  !! with each sign for every column. Rigid motions give zero up to round-off. What is joined at
  !! seams counts once; it is fixed where its first member is.
  function free_frequencies(bodies, seams, law, fixed, joints) result(omega)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    type(fixed_t), intent(in) :: fixed(:)           !! by patch
    type(shell_joints_t), intent(in), optional :: joints   !! of shells that pass moments
    real(wp), allocatable :: omega(:)
    type(part_t), allocatable :: trial(:)
    type(seams_t) :: shared
    type(shell_joints_t) :: springs
    type(elastic_t) :: rigidity
    type(freedom_t), allocatable :: free(:)
    real(wp), allocatable :: matrix(:, :), root(:), plus(:), minus(:)
    real(wp) :: tiny_motion
    integer :: i

    free = list_free(bodies, seams, fixed)
    trial = elastic_copies(bodies)
    shared = seams
    if (present(joints)) springs = joints
    rigidity = elastic_t(density=law%density, bulk=law%bulk, shear=law%shear)
    tiny_motion = trial_amount(bodies)
    allocate (matrix(size(free), size(free)), plus(size(free)), minus(size(free)), root(size(free)))
    do i = 1, size(free)
      associate (inertia => bodies(free(i)%part)%element%inertia)
        root(i) = sqrt(sum_at(size(inertia), mod(free(i)%places - 1, size(inertia)) + 1, inertia))
      end associate
    end do
    do i = 1, size(free)
      call raise_forces(trial, shared, springs, rigidity, free(i), tiny_motion, free, plus)
      call raise_forces(trial, shared, springs, rigidity, free(i), -tiny_motion, free, minus)
      matrix(:, i) = (plus - minus)/(2.0_wp*tiny_motion*root*root(i))
    end do
    omega = sqrt(max(0.0_wp, eigenvalues(0.5_wp*(matrix + transpose(matrix)))))
  end function free_frequencies

  !> Displacement for differences of forces: small compared with the elements, and a power of two,
  !! so that positions take it without round-off.
  pure real(wp) function trial_amount(bodies) result(amount)
    type(part_t), intent(in) :: bodies(:)
    integer :: i

    amount = scale(1.0_wp, exponent(1.0e-6_wp*minval([(bodies(i)%element%shortest, &
                                                      i=1, size(bodies))])) - 1)
  end function trial_amount

  pure function list_free(bodies, seams, fixed) result(free)
    type(part_t), intent(in) :: bodies(:)
    type(seams_t), intent(in) :: seams
    type(fixed_t), intent(in) :: fixed(:)
    type(freedom_t), allocatable :: free(:)
    logical, allocatable :: counts(:)
    integer :: p, i, k, n, pass

    do pass = 1, 2
      n = 0
      do p = 1, size(bodies)
        counts = is_counted(seams, p, size(bodies(p)%element%mass))
        counts = [counts, counts, counts] .and. .not. [fixed(p)%is_fixed]
        do i = 1, size(counts)
          if (.not. counts(i)) cycle
          if (.not. moves_itself(bodies(p)%element%ties, shape(bodies(p)%element%mass), i)) cycle
          if (allocated(fixed(p)%leader)) then
            if (fixed(p)%leader(i) /= i) cycle
          end if
          n = n + 1
          if (pass == 1) cycle
          free(n)%part = p
          free(n)%places = [i]
          if (allocated(fixed(p)%leader)) &
            free(n)%places = pack([(k, k=1, size(counts))], fixed(p)%leader == i)
        end do
      end do
      if (pass == 1) allocate (free(n))
    end do
  end function list_free

  !> Is the control point of a component neither outside of an outline nor led by others?
  pure logical function moves_itself(ties, n, i)
    type(outline_ties_t), intent(in) :: ties
    integer, intent(in) :: n(3), i                 !! control points, place of the component

    moves_itself = .true.
    if (.not. allocated(ties%is_free)) return
    associate (at => mod(i - 1, n(1)*n(2)))
      moves_itself = ties%is_free(mod(at, n(1)) + 1, at/n(1) + 1)
    end associate
  end function moves_itself

  !> Forces in the free components that a motion of one of them raises.
  subroutine raise_forces(bodies, seams, springs, law, moved, amount, free, forces)
    type(part_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    type(shell_joints_t), intent(inout) :: springs
    type(elastic_t), intent(in) :: law
    type(freedom_t), intent(in) :: moved, free(:)
    real(wp), intent(in) :: amount
    real(wp), intent(out) :: forces(:)
    type(force_report_t) :: report
    integer :: p, i

    do p = 1, size(bodies)
      bodies(p)%element%motion%v = 0.0_wp
      if (p == moved%part) call set_places(size(bodies(p)%element%motion%v), moved%places, amount, &
                                            bodies(p)%element%motion%v)
      call collect(seams, p, size(bodies(p)%element%mass), 3, bodies(p)%element%motion%v)
    end do
    call sum_groups(seams, 3)
    do p = 1, size(bodies)
      call distribute(seams, p, size(bodies(p)%element%mass), 3, bodies(p)%element%motion%v)
    end do
    call lead_edges(bodies)
    call forces_of_parts(bodies, seams, law, 1.0_wp, report, .true., springs)
    do i = 1, size(free)
      associate (force => bodies(free(i)%part)%element%motion%internal_force)
        forces(i) = sum_at(size(force), free(i)%places, force)
      end associate
    end do
  end subroutine raise_forces

  pure subroutine set_places(n, places, amount, field)
    integer, intent(in) :: n, places(:)
    real(wp), intent(in) :: amount
    real(wp), intent(inout) :: field(n)

    field(places) = amount
  end subroutine set_places

  pure real(wp) function sum_at(n, places, field)
    integer, intent(in) :: n, places(:)
    real(wp), intent(in) :: field(n)

    sum_at = sum(field(places))
  end function sum_at

end module vibration
