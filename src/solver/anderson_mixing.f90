!> Anderson's acceleration of iterations whose tangent is not quite right: of the last steps, those
!! parts are taken back that the next steps would repeat (D. G. Anderson, J. ACM 12 (1965), 547; in
!! the form of H. F. Walker and P. Ni, SIAM J. Numer. Anal. 49 (2011), 1715).
module anderson_mixing
  use kinds, only: wp
  use linear_algebra, only: solve
  implicit none
  private

  public :: mixing_t, forget, mix_step

  integer, parameter :: most = 5                   !! steps that are remembered
  real(wp), parameter :: regular = 1.0e-12_wp      !! of the squares of the differences of steps

  !> Where the last iterations were and the steps that they proposed there.
  type :: mixing_t
    integer :: n = 0                               !! differences, the newest last
    real(wp), allocatable :: place(:), step(:)     !! of the last iteration
    real(wp), allocatable :: places(:, :), steps(:, :)   !! differences, (unknowns, n)
  end type mixing_t

contains

  !> Forget all iterations.
  pure subroutine forget(self)
    type(mixing_t), intent(inout) :: self

    self%n = 0
    if (allocated(self%place)) deallocate (self%place, self%step)
  end subroutine forget

  !> Remember an iteration; `step` becomes the one to take. The first iteration takes its own step.
  subroutine mix_step(self, place, step)
    type(mixing_t), intent(inout) :: self
    real(wp), intent(in) :: place(:)               !! where the iteration is
    real(wp), intent(inout) :: step(:)             !! that it proposes
    real(wp) :: matrix(most, most), shares(most)
    real(wp), allocatable :: own(:)
    integer :: i, j
    logical :: is_solved

    own = step
    if (allocated(self%place)) call remember(self, place - self%place, step - self%step)
    self%place = place
    self%step = own
    associate (n => self%n)
      if (n == 0) return
      do j = 1, n
        do i = 1, n
          matrix(i, j) = dot_product(self%steps(:, i), self%steps(:, j))
        end do
        shares(j) = dot_product(self%steps(:, j), own)
      end do
      do j = 1, n
        matrix(j, j) = (1.0_wp + regular)*matrix(j, j) + tiny(1.0_wp)
      end do
      call solve(matrix(:n, :n), shares(:n), is_solved)
      if (.not. is_solved) return
      do j = 1, n
        step = step - shares(j)*(self%places(:, j) + self%steps(:, j))
      end do
    end associate
  end subroutine mix_step

  !> Put a difference last; the oldest of too many goes.
  subroutine remember(self, place, step)
    type(mixing_t), intent(inout) :: self
    real(wp), intent(in) :: place(:), step(:)

    if (.not. allocated(self%places)) allocate (self%places(size(place), most), &
                                                self%steps(size(place), most))
    if (self%n == most) then
      self%places(:, :most - 1) = self%places(:, 2:)
      self%steps(:, :most - 1) = self%steps(:, 2:)
      self%n = most - 1
    end if
    self%n = self%n + 1
    self%places(:, self%n) = place
    self%steps(:, self%n) = step
  end subroutine remember

end module anderson_mixing
