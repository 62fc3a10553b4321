!> Mass scaling through the thickness as an effect: the last of the force stage.
module thickness_scaling
  use kinds, only: wp
  use assembly, only: assembly_t
  use column_scaling, only: column_directions, column_differences
  use effect, only: effect_t, instant_t
  implicit none
  private

  !> Adds to the forces what makes the lumped mass answer like the scaled one. These forces have no
  !! sum in any column and are no work: the kinetic energy of the scaled mass takes it up. The
  !! factors are those of the blank, which has one patch and no seams.
  type, extends(effect_t), public :: thickness_scaling_t
  contains
    procedure :: apply
  end type thickness_scaling_t

contains

  !> Forces -m (1 - 1/factor) times the difference of the acceleration, along the columns.
  subroutine apply(self, bodies, instant)
    class(thickness_scaling_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), allocatable :: acceleration(:, :, :, :), directions(:, :, :), differences(:, :, :)
    integer :: k, c

    associate (mass => bodies%blank%parts(1)%mass, motion => bodies%blank%parts(1)%motion, &
               factor => bodies%blank%parts(1)%column_factor)
      allocate (acceleration, mold=motion%x)
      do c = 1, 3
        acceleration(:, :, :, c) = (motion%external_force(:, :, :, c) &
                                    - motion%internal_force(:, :, :, c))/mass
      end do
      directions = column_directions(motion%x)
      differences = column_differences(mass, directions, acceleration)
      do k = 1, size(mass, 3)
        differences(:, :, k) = differences(:, :, k)*mass(:, :, k)*(1.0_wp - 1.0_wp/factor)
      end do
      do c = 1, 3
        do k = 1, size(mass, 3)
          motion%external_force(:, :, k, c) = motion%external_force(:, :, k, c) &
                                              - directions(:, :, c)*differences(:, :, k)
        end do
      end do
    end associate
  end subroutine apply

end module thickness_scaling
