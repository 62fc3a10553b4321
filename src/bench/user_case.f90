!> The bare loop of a user's subroutine over the points of a blank: what a call costs without all
!! that the program does for it. Stress and state are those of the force routine with the same law.
module user_case
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  use failure, only: error_t, fail
  use user_call, only: umat_procedure, vumat_procedure, user_law_t, name_length
  use umat_adapter, only: umat_adapter_t
  use vumat_adapter, only: vumat_adapter_t
  use bench_case, only: bench_case_t
  use force_case, only: force_case_t, dt
  implicit none
  private

  type, extends(bench_case_t), public :: user_case_t
    type(force_case_t) :: loaded                 !! blank of that law
    real(wp), allocatable, dimension(:, :) :: start, stress     !! (6, points), of a VUMAT in blocks
    real(wp), allocatable, dimension(:, :) :: start_state, state
    procedure(umat_procedure), pointer, nopass :: umat => null()
    procedure(vumat_procedure), pointer, nopass :: vumat => null()
  contains
    procedure :: prepare
    procedure :: run
    procedure :: restore
  end type user_case_t

  integer, parameter :: n_block = 64             !! elements of a call of a VUMAT
  real(wp), parameter :: dstrain(6) = 1.0e-4_wp*[1.0_wp, -0.5_wp, -0.5_wp, 0.2_wp, 0.0_wp, 0.3_wp]

contains

  !> The blank and its points after loading.
  subroutine prepare(self, error)
    class(user_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable, dimension(:, :, :, :, :, :, :) :: stress, state
    real(wp), allocatable :: eqps(:, :, :, :, :, :)
    integer :: n

    call self%loaded%prepare(error)
    if (allocated(error)) return
    if (mod(self%loaded%n_points*product(self%loaded%n_elements), n_block) /= 0) then
      call fail(error, self%name//": points that fill no whole blocks")
      return
    end if
    associate (element => self%loaded%part%element, law => self%loaded%law)
      associate (q => element%rule%n, m => element%n_elements)
        allocate (eqps(q(1), q(2), q(3), m(1), m(2), m(3)))
        allocate (stress(6, q(1), q(2), q(3), m(1), m(2), m(3)))
        allocate (state(law%n_state - law%n_hidden, q(1), q(2), q(3), m(1), m(2), m(3)))
      end associate
      call element%read_points(0, eqps, stress, state)
      self%n_points = product(element%rule%n)
      self%n_units = product(element%n_elements)
      select type (law)
      type is (umat_adapter_t)
        self%umat => law%umat
      type is (vumat_adapter_t)
        self%vumat => law%vumat
      end select
    end associate
    n = size(eqps)
    self%start = reshape(stress, [6, n])
    self%start_state = reshape(state, [size(state)/n, n])
    if (associated(self%vumat)) call to_blocks(self%start)
    if (associated(self%vumat)) call to_blocks(self%start_state)
  end subroutine prepare

  !> From point by point to blocks of points, component by component in each.
  subroutine to_blocks(values)
    real(wp), intent(inout) :: values(:, :)
    integer :: b

    do b = 1, size(values, 2) - n_block + 1, n_block
      values(:, b:b + n_block - 1) = reshape(transpose(values(:, b:b + n_block - 1)), &
                                             [size(values, 1), n_block])
    end do
  end subroutine to_blocks

  subroutine restore(self)
    class(user_case_t), intent(inout) :: self

    self%stress = self%start
    self%state = self%start_state
  end subroutine restore

  !> All points once.
  subroutine run(self)
    class(user_case_t), intent(inout) :: self
    integer :: p

    select type (law => self%loaded%law)
    class is (user_law_t)
      if (associated(self%umat)) then
        !$omp parallel do schedule(static)
        do p = 1, size(self%stress, 2)
          call call_umat(law, self%umat, p, self%stress(:, p), self%state(:, p))
        end do
        !$omp end parallel do
      else
        !$omp parallel do schedule(static)
        do p = 1, size(self%stress, 2), n_block
          call call_vumat(law, self%vumat, size(self%state, 1), self%stress(1, p), self%state(1, p))
        end do
        !$omp end parallel do
      end if
    end select
  end subroutine run

  subroutine call_umat(law, umat, p, stress, state)
    class(user_law_t), intent(in) :: law
    procedure(umat_procedure) :: umat
    integer, intent(in) :: p
    real(wp), intent(inout) :: stress(6), state(*)
    real(wp), parameter :: f(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                              0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    real(wp), parameter :: none(6) = 0.0_wp
    real(wp) :: tangent(6, 6), energies(3), heat(2), six(6), other(6), pnewdt

    energies = 0.0_wp
    pnewdt = 1.0_wp
    call umat(stress, state, tangent, energies(1), energies(2), energies(3), heat(1), six, other, &
              heat(2), none, dstrain, none, dt, 0.0_wp, 0.0_wp, none, none, law%name, 3_c_int, &
              3_c_int, 6_c_int, int(law%n_statv, c_int), law%props, int(law%n_props, c_int), &
              none, f, pnewdt, 1.0_wp, f, f, int(p, c_int), 1_c_int, 1_c_int, 1_c_int, &
              [1_c_int, 0_c_int, 0_c_int, 0_c_int], 2_c_int, int(name_length, c_size_t))
  end subroutine call_umat

  subroutine call_vumat(law, vumat, n_state, stress, state)
    class(user_law_t), intent(in) :: law
    procedure(vumat_procedure) :: vumat
    integer, intent(in) :: n_state
    real(wp), intent(inout) :: stress(n_block, 6), state(n_block, n_state)
    real(wp), dimension(n_block, 6) :: strain, new
    real(wp) :: none(n_block, 9), new_state(n_block, n_state), energies(n_block, 2), one(n_block)
    integer(c_int) :: jblock(n_block + 4), jinfo(n_block + 6)
    integer :: c

    do c = 1, 6
      strain(:, c) = dstrain(c)*merge(0.5_wp, 1.0_wp, c > 3)
    end do
    none = 0.0_wp
    one = 1.0_wp
    jblock = 1_c_int
    jblock(1) = n_block
    jinfo = 0_c_int
    call vumat(jblock, 3_c_int, 3_c_int, int(law%n_statv, c_int), 0_c_int, &
               int(law%n_props, c_int), jinfo, dt, dt, spread(dt, 1, 2*n_block + 1), law%name, &
               none, one, law%props, one, strain, none, none, none, none, none, stress, state, &
               none(1, 1), none(1, 2), none, none, none, none, new, new_state, energies(1, 1), &
               energies(1, 2), int(name_length, c_size_t))
    stress = new
    state = new_state
  end subroutine call_vumat

end module user_case
